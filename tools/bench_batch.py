"""Measure batches: what the scheduler costs for many objects, and real captures compared with a
loop in a shell."""

from __future__ import annotations

import hashlib
import json
import random
import shlex
import subprocess
import sys
import tempfile
import time
from collections.abc import Sequence
from pathlib import Path

from .common import ROOT
from .faults.killed_cluster import KilledCluster

EMPTY = (250, 500, 1000, 2000)  # objects of no work
CAPTURES, WORKERS = 200, 2  # small captures that are fitted, and processes at a time
KILLS, PAUSES = 30, (10.0, 40.0)  # of schedulers and workers; seconds between two
MEGAPIXELS, TRIANGLES, PHOTOS = 0.02, 2000, 3
ABANDONED_SECONDS = 61.0  # after which what a killed process has left is removed
IRRADIANCE = 3.0  # that the captures are made with
PEAK = "import resource; print(resource.getrusage(resource.RUSAGE_SELF).ru_maxrss // 1024)"


def run(data: Path) -> None:
    """Print the tables of docs/guide/batch.md. data: not used."""
    with tempfile.TemporaryDirectory() as name:
        _empty(Path(name))
        _real(Path(name))


def _empty(folder: Path) -> None:
    """The time and memory that the scheduler needs for objects without work."""
    print("| objects without work | seconds | for each object | peak memory of the command |\n"
          "|---|---|---|---|")  # fmt: skip
    program = shlex.join([sys.executable, str(ROOT / "tests" / "empty_command.py")])
    for count in EMPTY:
        path = folder / f"empty{count}"
        for k in range(count):
            (path / f"{k}").mkdir(parents=True)
            (path / f"{k}" / "x.capture.toml").write_text("")
        words = [str(path), "--out", str(folder / f"out{count}"), "--program", program]
        seconds, memory = _batch(words)
        print(
            f"| {count:,} | {seconds:.1f} | {1000 * seconds / count:.0f} ms | {memory} MB |",
            flush=True,
        )


def _real(folder: Path, count: int = CAPTURES) -> None:
    """The same captures by a loop, by a batch, and by a batch whose cluster is killed."""
    captures = _captures(folder / "captures", count)
    since = time.monotonic()
    program = shlex.join([sys.executable, str(ROOT / "tools" / "faults" / "quick_fit.py")])
    loop = (
        f"printf '%s\\n' {shlex.join(str(c) for c in captures)} | xargs -P {WORKERS} -I CAPTURE "
        f"sh -c '{program} fit CAPTURE --threads 1 --out "
        f"{folder}/loop/$(basename $(dirname CAPTURE)) >/dev/null 2>&1'"
    )
    subprocess.run(["sh", "-c", loop], check=True)
    looped = time.monotonic() - since
    words = [str(folder / "captures"), "--threads", "1", "--program", program, "--out"]
    batched, _ = _batch([*words, str(folder / "batch"), "--workers", str(WORKERS)])
    print(
        f"\n{count} captures, {WORKERS} processes: loop {looped:.1f} s, batch {batched:.1f} s "
        f"({100 * (batched / looped - 1):+.1f} %); {_equal(folder, 'batch', captures)}",
        flush=True,
    )
    with KilledCluster(folder / "dask") as cluster:
        command = [sys.executable, str(ROOT / "headless.py"), "batch", *words, f"{folder}/killed"]
        since = time.monotonic()
        code, said = cluster.run(
            [*command, "--scheduler", cluster.address],
            random.Random(0), KILLS, PAUSES, 3 * looped + 300,
        )  # fmt: skip
        seconds, kills = time.monotonic() - since, cluster.kills
    if code != 0:
        raise RuntimeError(f"exit code {code}: {said}")
    finished = (folder / "killed" / "collection.csv").read_text("utf-8").count(",finished,")
    time.sleep(ABANDONED_SECONDS)
    _batch([*words, str(folder / "killed")])  # runs no object again, removes what is left
    print(
        f"With {kills} kills of scheduler and workers: {seconds:.1f} s, {finished} of {count} "
        f"objects finished; after the next batch, {_equal(folder, 'killed', captures)}"
    )


def _captures(folder: Path, count: int) -> list[Path]:
    """Small captures that differ in the irradiance of their lamps, fitted by the paper's method,
    which takes less time."""
    from .bench_speed_scene import make_capture

    found = []
    for k in range(count):
        capture = make_capture(folder / f"{k:03d}", MEGAPIXELS, TRIANGLES, PHOTOS)
        text, level = capture.read_text("utf-8"), f"{IRRADIANCE * (1 + k / 1000):.4f}"
        changed = text.replace(f"{IRRADIANCE}", level)
        assert k == 0 or changed != text
        capture.write_text(f'[fit]\nmethod = "paper"\n\n{changed}', "utf-8")
        found.append(capture)
    return found


def _equal(folder: Path, name: str, captures: Sequence[Path]) -> str:
    """How many results have the bytes of those of the loop."""
    both = [(folder / "loop" / c.parent.name, folder / name / c.parent.name) for c in captures]
    contents = [(_content(one), _content(other)) for one, other in both]
    differ = {
        file
        for one, other in contents
        for file in one.keys() | other.keys()
        if one.get(file) != other.get(file)
    }
    same = sum(one == other for one, other in contents)
    names = f" ({', '.join(sorted(differ)[:5])} differ)" if differ else ""
    return f"{same} of {len(both)} results with the same bytes{names}"


def _content(folder: Path) -> dict[str, str]:
    """Hash of each file of a result. Left out: the times in result.json, the record that has its
    hash, and scene.blend, in which Blender writes addresses of its memory."""
    found = {}
    for file in sorted(folder.rglob("*")):
        if not file.is_file() or file.name in (".patina-files", "scene.blend"):
            continue
        content = file.read_bytes()
        if file.name == "result.json":
            result = json.loads(content)
            del result["stages"]
            content = json.dumps(result).encode()
        found[file.relative_to(folder).as_posix()] = hashlib.sha256(content).hexdigest()
    return found


def _batch(words: list[str]) -> tuple[float, int]:
    """(seconds, peak memory in MB) of the command."""
    code = (
        "import sys; sys.argv = sys.argv[1:]; import runpy\n"
        "try: runpy.run_path(sys.argv[0], run_name='__main__')\n"
        f"except SystemExit as end: assert not end.code, end.code\n{PEAK}"
    )
    since = time.monotonic()
    command = [sys.executable, "-c", code, str(ROOT / "headless.py"), "batch", *words]
    done = subprocess.run(command, capture_output=True, text=True)
    if done.returncode:
        raise RuntimeError(done.stderr)
    return time.monotonic() - since, int(done.stdout.split()[-1])
