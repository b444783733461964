"""`run.py fuzz [--runs N] [--seconds S] [READER ...]`: give changed files to the readers, guided by
the code that they reach (atheris, libFuzzer).

A reader may refuse a file (PatinaError). Any other error, more than 5 s and more than 2 GB are
faults: their inputs are written to the folder given by --out. Inputs that reach new code are kept
in the cache, and the next run starts from them.
"""

from __future__ import annotations

import argparse
import contextlib
import os
import re
import shutil
import subprocess
import sys
import tempfile
from pathlib import Path

from .common import ROOT, Failure, cache_dir, quietly, say
from .package import load_patina

ATHERIS = "atheris==3.0.0"
HASH = "8a5c8a781467c187da40fd29139784193e2647058831f837f675d0bb8cbd8746"
"""SHA-256 of its wheel for Linux and Python 3.11, the only one that is used."""
RUNS, SECONDS = 100_000, 600  # of each reader, whichever is reached first
MAX_SECONDS, MAX_MEGABYTES = 5, 2048  # of one input; of the process
MAX_BYTES = 1 << 16  # of an input
FAST_DISK = Path("/dev/shm")


def main() -> int:
    """Attack the readers; return 1 if any has a fault."""
    parser = argparse.ArgumentParser(prog="run.py fuzz", description=__doc__)
    parser.add_argument("--runs", type=int, default=RUNS, help="inputs (default %(default)s)")
    parser.add_argument("--seconds", type=int, default=SECONDS, help="limit (default %(default)s)")
    parser.add_argument("--out", type=Path, default=Path("fuzz-faults"), help="folder for faults")
    parser.add_argument("--one", help=argparse.SUPPRESS)
    parser.add_argument("readers", nargs="*", help="readers to attack (default: all)")
    arguments, rest = parser.parse_known_args()
    load_patina()
    from .fuzz_targets import targets

    if arguments.one:
        return _attack(arguments.one, rest)
    known = targets()
    unknown = [name for name in arguments.readers if name not in known]
    if unknown:
        parser.error(f"found {unknown[0]!r}; expected one of {', '.join(known)}")
    library = _library()
    print("| reader | inputs | seconds | peak memory | faults |\n|---|---|---|---|---|")
    faults = 0
    for name in arguments.readers or known:
        faults += _report(name, arguments, library)
    print(f"{faults} faults" + (f", in {arguments.out}" if faults else ""))
    return 1 if faults else 0


def _library() -> Path:
    """The folder of atheris, installed on first use. Raises Failure."""
    folder = cache_dir() / f"fuzz-{HASH[:10]}"
    if not folder.is_dir():
        if sys.platform != "linux" or sys.version_info[:2] != (3, 11):
            raise Failure("fuzz needs Linux and Python 3.11, for which atheris is pinned")
        say(f"installing {ATHERIS} ...")
        making = folder.with_suffix(".making")
        shutil.rmtree(making, ignore_errors=True)
        with tempfile.NamedTemporaryFile("w", suffix=".txt") as wanted:
            wanted.write(f"{ATHERIS} --hash=sha256:{HASH}\n")
            wanted.flush()
            quietly(
                [sys.executable, "-m", "pip", "install", "--quiet", "--no-deps",
                 "--require-hashes", "--target", making, "-r", wanted.name],
                f"installing {ATHERIS}",
            )  # fmt: skip
        making.rename(folder)
    return folder


def _report(name: str, arguments: argparse.Namespace, library: Path) -> int:
    """Attack one reader in a process of its own; print its row. Returns the number of faults."""
    from .fuzz_targets import targets

    target = targets()[name]
    slug = re.sub(r"\W", "_", name)
    corpus = cache_dir() / "fuzz" / slug
    corpus.mkdir(parents=True, exist_ok=True)
    for number, content in enumerate(target.seeds):
        (corpus / f"seed{number}").write_bytes(content[:MAX_BYTES])
    arguments.out.mkdir(parents=True, exist_ok=True)
    command = [
        sys.executable, "-m", "tools.fuzz", "--one", name, f"-runs={arguments.runs}",
        f"-max_total_time={arguments.seconds}", f"-timeout={MAX_SECONDS}",
        f"-rss_limit_mb={MAX_MEGABYTES}", f"-max_len={MAX_BYTES}", "-print_final_stats=1",
        f"-artifact_prefix={arguments.out.resolve()}/{slug}-", str(corpus),
    ]  # fmt: skip
    environment = {**os.environ, "PYTHONPATH": os.pathsep.join([str(ROOT), str(library)])}
    done = subprocess.run(
        command, capture_output=True, text=True, env=environment, errors="replace"
    )
    printed = done.stdout + done.stderr
    inputs, memory = _number(printed, "number_of_executed_units"), _number(printed, "peak_rss_mb")
    seconds = re.search(r"Done \d+ runs in (\d+) second", printed)
    wrong = done.returncode != 0
    print(
        f"| {name} | {inputs:,} | {seconds[1] if seconds else '?'} | {memory} MB | {int(wrong)} |",
        flush=True,
    )
    if wrong:
        lines = [line for line in printed.splitlines() if line.strip()]
        error = [i for i, line in enumerate(lines) if "Traceback" in line or "ERROR" in line]
        print("\n".join(lines[error[0] : error[0] + 30] if error else lines[-15:]), file=sys.stderr)
    return int(wrong)


def _number(printed: str, name: str) -> int:
    found = re.search(rf"stat::{name}:\s+(\d+)", printed)
    return int(found[1]) if found else 0


def _attack(name: str, words: list[str]) -> int:
    """Run libFuzzer on one reader; does not return."""
    import atheris

    from .fuzz_targets import targets

    with atheris.instrument_imports(include=["patina.core"]):
        target = targets()[name]  # imports the readers
        from patina.core.errors import PatinaError
    disk = FAST_DISK if FAST_DISK.is_dir() else None
    folder = Path(tempfile.mkdtemp(prefix="patina-fuzz-", dir=disk))
    for other, content in target.others:
        (folder / other).parent.mkdir(parents=True, exist_ok=True)
        (folder / other).write_bytes(content)
    path = folder / target.file

    def one(content: bytes) -> None:
        path.write_bytes(content)
        with contextlib.suppress(PatinaError):
            target.read(path)

    atheris.Setup([name, *words], one)
    try:
        atheris.Fuzz()
    finally:
        shutil.rmtree(folder, ignore_errors=True)
    return 0


if __name__ == "__main__":
    sys.exit(main())
