"""`run.py torture [--kills N]`: kill commands at random moments (SIGKILL), and check that each of
them leaves the old result or the new one, whole, and that the next run leaves nothing else."""

from __future__ import annotations

import argparse
import os
import random
import signal
import subprocess
import sys
import tempfile
import time
from collections.abc import Sequence
from pathlib import Path

from ..package import load_patina
from .cases import (
    COMMANDS,
    LEFTOVERS,
    Case,
    make_cases,
    prepare,
    result_faults,
    run,
    shown_capture,
)

LATE_SHARE = 0.5  # of the kills happen in the last part of a run, where its result is moved
LATE = 0.85  # start of this part
MAX_RUNS = 3  # for each kill: some commands end before it
AGE = 120.0  # seconds by which abandoned folders are aged: younger ones may belong to a process
PARTIAL = ".part"  # ending of files that are being written
END_SECONDS = 10.0  # after which the processes of a killed command must have ended


def main() -> int:
    """Run the kills; return 1 if a result was lost."""
    parser = argparse.ArgumentParser(prog="run.py torture", description=__doc__)
    parser.add_argument("--kills", type=int, default=200, help="number (default %(default)s)")
    parser.add_argument("--seed", type=int, default=0, help="of the moments (default %(default)s)")
    parser.add_argument("commands", nargs="*", help="commands to kill (default: all)")
    arguments = parser.parse_args()
    load_patina()
    with tempfile.TemporaryDirectory(prefix="patina-torture-") as name:
        cases = make_cases(Path(name), arguments.commands)
        if not cases:
            parser.error(f"found no such command; expected one of {', '.join(COMMANDS)}")
        for case in cases:
            prepare(case)
        wrong = _kill(cases, arguments.kills, random.Random(arguments.seed))
        wrong += [fault for case in cases for fault in _left(case)]
    if not any(case.kills for case in cases):
        wrong.append("every command ended before it was killed")
    print("| command | seconds | killed | old result | new result |\n|---|---|---|---|---|")
    for case in cases:
        print(f"| {case.name} | {case.seconds:.1f} | {case.kills} | {case.old} | {case.new} |")
    print(*wrong, f"{sum(c.kills for c in cases)} kills, {len(wrong)} faults", sep="\n")
    return 1 if wrong else 0


def _kill(cases: Sequence[Case], kills: int, chance: random.Random) -> list[str]:
    """Kill each command in turn, until so many were killed; returns the faults."""
    wrong: list[str] = []
    for number in range(MAX_RUNS * kills):
        if sum(case.kills for case in cases) >= kills:
            break
        case = cases[number % len(cases)]
        before = shown_capture(case)
        which = 1 - before
        late = chance.random() < LATE_SHARE
        moment = case.seconds * (chance.uniform(LATE, 1.05) if late else chance.random())
        _age(case)
        process = subprocess.Popen(
            case.command(which),
            stdout=subprocess.DEVNULL,
            stderr=subprocess.DEVNULL,
            start_new_session=True,
        )
        failed: list[str] = []
        try:
            since = time.monotonic()
            if process.wait(moment):
                failed = [f"ended with exit code {process.returncode}"]
            case.seconds = min(case.seconds, time.monotonic() - since)  # faster than expected
        except subprocess.TimeoutExpired:
            process.kill()  # alone: its own processes must end with it
            process.wait()
            case.kills += 1
            failed = _survivors(process.pid)
        faults = [
            f"{case.name}, kill {number} after {moment:.2f} s: {f}"
            for f in (*failed, *result_faults(case))
        ]
        wrong += faults
        case.new += not faults and shown_capture(case) == which
        case.old += not faults and shown_capture(case) == before
        if sys.stderr.isatty():
            print(f"\r{number + 1} of {kills}, {len(wrong)} faults", end="", file=sys.stderr)
    return wrong


def _survivors(group: int) -> list[str]:
    """Whether processes of a killed command still run after END_SECONDS; they are killed then."""
    until = time.monotonic() + END_SECONDS
    while time.monotonic() < until:
        try:
            os.killpg(group, 0)
        except ProcessLookupError:
            return []
        time.sleep(0.05)
    os.killpg(group, signal.SIGKILL)
    return [f"processes still ran {END_SECONDS:g} s after the kill"]


def _left(case: Case) -> list[str]:
    """What is left beside a result after another run."""
    _age(case)
    run(case.command(0))
    folders = {case.result, case.out, case.out.parent}
    names = [path.name for folder in folders for path in folder.iterdir()]
    left = [name for name in names if name.startswith(LEFTOVERS) or name.endswith(PARTIAL)]
    return [f"{case.name}: left behind: {left}"] if left else result_faults(case)


def _age(case: Case) -> None:
    """Let what killed processes have left be as old as what is removed."""
    then = time.time() - AGE
    for folder in (case.result, case.out, case.out.parent):
        for path in (*folder.glob(".patina-part-*"), *folder.glob(f"*{PARTIAL}")):
            os.utime(path, (then, then))


if __name__ == "__main__":
    sys.exit(main())
