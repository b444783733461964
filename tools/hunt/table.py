"""`run.py hunt`: captures with a hidden effect, diagnosed; the table of docs/diagnosis.md."""

from __future__ import annotations

import argparse
import sys
import tempfile
import time
from pathlib import Path

from ..common import say
from ..package import load_patina

STRENGTHS = (0.01, 0.03, 0.1)
SEEDS = 5


def main() -> int:
    """Make and diagnose captures; prints a row each, then how many were right."""
    load_patina()
    from .make import MAKERS, OUTSIDERS

    parser = argparse.ArgumentParser(prog="run.py hunt", description=__doc__)
    parser.add_argument("causes", nargs="*", help=f"of none, {', '.join(MAKERS)}; default: all")
    parser.add_argument("--strengths", type=float, nargs="+", default=STRENGTHS, metavar="RMS")
    parser.add_argument("--seeds", type=int, nargs="+", default=list(range(1, SEEDS + 1)))
    told = parser.parse_args()
    known = {"none", *MAKERS, *OUTSIDERS}
    unknown = [c for c in told.causes if not known.issuperset(c.split("+"))]
    if unknown:
        parser.error(f"nothing hides {unknown[0]!r}; there are none, {', '.join(MAKERS)}")
    print("| hidden | RMS change | seed | named | gain, standard errors | made | diagnosed |")
    print("|---|---|---|---|---|---|---|")
    right: dict[tuple[str, float], list[bool]] = {}
    for cause in told.causes or ("none", *MAKERS):
        for strength in told.strengths if cause != "none" else (0.0,):
            for seed in told.seeds:
                named = _one(cause, strength, seed)
                right.setdefault((cause, strength), []).append((named or ("none",)) == (cause,))
    print("\n| hidden | RMS change | right |\n|---|---|---|")
    for (cause, strength), found in right.items():
        print(f"| {cause} | {100 * strength:.0f} % | {sum(found)} of {len(found)} |")
    return 0


def _one(cause: str, strength: float, seed: int) -> tuple[str, ...]:
    """Make, diagnose, print the row; what was named."""
    from patina.core.capture import read_capture
    from patina.core.job import FitJob
    from patina.core.job.diagnose_job import DiagnoseJob

    from .make import make

    with tempfile.TemporaryDirectory() as folder:
        since = time.perf_counter()
        truth = make(Path(folder), cause, strength, seed)
        made = time.perf_counter()
        job = DiagnoseJob(FitJob(read_capture(Path(folder) / "hunt.capture.toml")))
        job.drain()
        done = time.perf_counter()
    assert job.found is not None
    accepted = job.found.accepted
    gain = f"{accepted[0].gain / max(accepted[0].error, 1e-9):.1f}" if accepted else "–"
    named = ", ".join(job.found.causes) or "none"
    print(
        f"| {cause} | {100 * truth.strength:.1f} % | {seed} | {named} | {gain} | "
        f"{made - since:.0f} s | {done - made:.0f} s |",
        flush=True,
    )
    say(f"{cause} at {100 * strength:.0f} %, seed {seed}: {named}")
    return job.found.causes


if __name__ == "__main__":
    sys.exit(main())
