"""Measure batches: what the scheduler costs for many objects, and real captures compared with a
loop in a shell."""

from __future__ import annotations

import hashlib
import shlex
import shutil
import subprocess
import sys
import tempfile
import time
from pathlib import Path

from .common import ROOT

EMPTY = (250, 500, 1000, 2000)  # objects of no work
CAPTURES, WORKERS = 12, 2  # small captures that are fitted, and processes at a time
MEGAPIXELS, TRIANGLES, PHOTOS = 0.02, 2000, 3
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


def _real(folder: Path) -> None:
    """The same captures by a batch and by a loop, with equal numbers of processes."""
    from .bench_speed_scene import make_capture

    path = folder / "captures"
    for k in range(CAPTURES):
        make_capture(path / f"{k:03d}", MEGAPIXELS, TRIANGLES, PHOTOS)
    captures = sorted(path.rglob("*.capture.toml"))
    since = time.monotonic()
    program = [sys.executable, str(ROOT / "headless.py"), "fit"]
    loop = (
        f"printf '%s\\n' {shlex.join(str(c) for c in captures)} | xargs -P {WORKERS} -I CAPTURE "
        f"sh -c '{shlex.join(program)} CAPTURE --threads 1 --out "
        f"{folder}/loop/$(basename $(dirname CAPTURE)) >/dev/null 2>&1'"
    )
    subprocess.run(["sh", "-c", loop], check=True)
    looped = time.monotonic() - since
    words = [str(path), "--out", str(folder / "batch"), "--workers", str(WORKERS), "--threads", "1"]
    batched, _ = _batch(words)
    same = [_tables(folder / "loop" / c.parent.name) == _tables(folder / "batch" / c.parent.name)
            for c in captures]  # fmt: skip
    print(
        f"\n{CAPTURES} captures, {WORKERS} processes: loop {looped:.1f} s, batch {batched:.1f} s "
        f"({100 * (batched / looped - 1):+.1f} %); {sum(same)} of {len(same)} results with the "
        "same bytes"
    )
    shutil.rmtree(path)


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


def _tables(folder: Path) -> list[str]:
    """Hashes of the tables of a result; result.json has the seconds of each run."""
    return [hashlib.sha256(f.read_bytes()).hexdigest() for f in sorted(folder.glob("*.binary"))]
