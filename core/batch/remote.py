"""What a worker of the cluster runs: a process for one object, with limits. This module is sent to
the workers as it is, so that it uses only the standard library and psutil, which Dask needs too."""

from __future__ import annotations

import contextlib
import hashlib
import json
import os
import secrets
import subprocess
import tempfile
import time
from pathlib import Path
from typing import Any

LOOK_INTERVAL = 0.5  # seconds between two looks at the process
END_SECONDS = 5.0  # that a process has to remove its incomplete files before it is killed
MAX_RECORD_BYTES = 1 << 20
# Dask sets it for its workers, so that they return freed memory at once. A fit then spends half of
# its time in the kernel (measured), because it frees and takes the same memory again and again
NOT_INHERITED = "MALLOC_TRIM_THRESHOLD_"
MAX_MESSAGE = 2000  # characters of an error that are kept


def run_process(
    words: list[str],
    environment: dict[str, str],
    result: str,
    record: str,
    inputs: str,
    attempt: int,
    max_gb: float,
    max_seconds: float,
) -> dict[str, Any]:
    """Run a process, and record its result. Returns its exit code, seconds, peak memory
    and the end of its messages.

    result: folder that the process writes; record: file to write where it succeeds; inputs: hash of
    what the result depends on. max_gb, max_seconds: limits, 0 for none.
    """
    known = recorded(result, record, inputs)
    if known is not None:  # by a worker that was lost before it could report
        return known
    since = time.monotonic()
    inherited = {key: value for key, value in os.environ.items() if key != NOT_INHERITED}
    with tempfile.TemporaryFile() as messages:
        process = subprocess.Popen(
            words,
            stdin=subprocess.PIPE,  # is closed when this worker ends; the process ends then too
            stdout=subprocess.DEVNULL,
            stderr=messages,
            env={**inherited, **environment},
        )
        try:
            peak, stopped = _watch(process, since, max_gb, max_seconds)
        finally:
            if process.poll() is None:
                process.kill()
                process.wait()
            assert process.stdin is not None
            process.stdin.close()
        messages.seek(0)
        text = messages.read().decode("utf-8", "replace")
    found = {
        "code": process.returncode, "seconds": round(time.monotonic() - since, 2),
        "peak_mb": round(peak / 2**20), "attempts": attempt,
        "message": stopped or _message(text, process.returncode),
    }  # fmt: skip
    if process.returncode == 0 and not stopped:
        own = {"inputs": inputs, "result": _content(result), **found}
        partial = Path(f"{record}.{secrets.token_hex(8)}.part")  # as core/files.py names it
        partial.write_text(json.dumps(own), "utf-8")
        os.replace(partial, record)
    return found


def recorded(result: str, record: str, inputs: str) -> dict[str, Any] | None:
    """The record of an object whose result is there, and was computed from the same inputs; else
    None."""
    try:
        if not os.path.isfile(record) or os.path.getsize(record) > MAX_RECORD_BYTES:
            return None
        known = json.loads(Path(record).read_bytes())
        if known["inputs"] != inputs or known["result"] != _content(result):
            return None
    except (OSError, ValueError, KeyError, TypeError):
        return None
    return {key: known[key] for key in ("code", "seconds", "peak_mb", "attempts", "message")}


def _content(result: str) -> str:
    """The hash of the record of a result's files. Raises OSError where one is missing."""
    content = Path(result, ".patina-files").read_bytes()
    for name in json.loads(content):
        os.stat(os.path.join(result, name))
    return hashlib.blake2b(content).hexdigest()[:32]


def _watch(
    process: subprocess.Popen[bytes], since: float, max_gb: float, max_seconds: float
) -> tuple[float, str]:
    """Wait for the process. Returns (peak memory in bytes, why it was stopped)."""
    import psutil

    peak, stopped = 0.0, ""
    while True:
        try:
            process.wait(LOOK_INTERVAL)
            return peak, stopped
        except subprocess.TimeoutExpired:
            pass
        try:
            own = psutil.Process(process.pid)
            family = [own, *own.children(recursive=True)]
            peak = max(peak, float(sum(one.memory_info().rss for one in family)))
        except psutil.Error:
            continue
        if max_gb and peak > max_gb * 2**30:
            stopped = f"needs more than {max_gb:g} GB of memory"
        elif max_seconds and time.monotonic() - since > max_seconds:
            stopped = f"takes more than {max_seconds:g} seconds"
        if stopped:
            for one in reversed(family):
                with contextlib.suppress(psutil.Error):  # it has ended meanwhile
                    one.terminate()
            for one in psutil.wait_procs(family, END_SECONDS)[1]:
                with contextlib.suppress(psutil.Error):
                    one.kill()


def _message(text: str, code: int) -> str:
    """The last error of a process, "" where it succeeded."""
    if code == 0:
        return ""
    lines = [line.strip() for line in text.splitlines() if line.strip()]
    own = [line.removeprefix("patina: ") for line in lines if line.startswith("patina: ")]
    last = (own or lines or [""])[-1]
    return (last or f"ended with exit code {code}")[:MAX_MESSAGE]
