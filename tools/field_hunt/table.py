"""`run.py hunt --field`: diagnose captures of scans as they are.

Meshes with errors of stereo, poses of structure from motion, materials of no basis, distant, near
and flash lamps, linear and 8-bit photos; and effects hidden in real photographs. Every row is
stored when it is computed, so that the table can be made in several runs.
"""

from __future__ import annotations

import argparse
import json
from collections.abc import Iterator, Sequence
from dataclasses import asdict
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from ..common import say
from ..package import load_patina

if TYPE_CHECKING:
    from .judged import FieldRow

STRENGTHS = (0.03, 0.1)  # relative RMS change of the photos
SEEDS = 6  # of simulated captures with an effect
WORST_DECILE = 90  # percentile
NONES = 48  # seeds of simulated captures without


def main(words: Sequence[str]) -> int:
    """Make and diagnose captures; print one line for each, then the counts."""
    load_patina()
    from .judged import judged

    parser = argparse.ArgumentParser(prog="run.py hunt --field", description=__doc__)
    parser.add_argument("causes", nargs="*", help="none or causes; default: all of the table")
    parser.add_argument("--strengths", type=float, nargs="+", default=STRENGTHS, metavar="RMS")
    parser.add_argument("--seeds", type=int, nargs="+", help="of simulated captures")
    parser.add_argument("--real", nargs="*", metavar="SET", help="real sets only; default: all")
    parser.add_argument("--rows", type=Path, metavar="FILE", help="stored rows (JSON lines)")
    parser.add_argument("--threads", type=int, metavar="N")
    parser.add_argument("--only-print", action="store_true", help="print the stored rows only")
    arguments = parser.parse_args(words)
    rows = read_rows(arguments.rows)
    for source, cause, strength, seed in [] if arguments.only_print else wanted(arguments):
        if any(
            (r.source, r.cause, r.wanted, r.seed) == (source, cause, strength, seed) for r in rows
        ):
            continue
        row = judged(source, cause, strength, seed, arguments.threads)
        rows.append(row)
        say(f"{source}, {cause} at {100 * strength:.0f} %, seed {seed}: "
            f"{', '.join(row.named) or 'none'} ({row.seconds:.0f} s)")  # fmt: skip
        if arguments.rows is not None:
            with arguments.rows.open("a", encoding="utf-8") as file:
                file.write(json.dumps(asdict(row)) + "\n")
    print(table(rows))
    return 0


def wanted(arguments: argparse.Namespace) -> Iterator[tuple[str, str, float, int]]:
    """Yield (source, cause, strength, seed); causes that a capture's kind of lamp cannot have are
    left out."""
    from .make import MAKERS, setting
    from .real_sets import DISTANT_SETS, EFFECTS, PLANES

    chosen = set(arguments.causes)
    if arguments.real is None:
        for seed in arguments.seeds or range(NONES):
            if not chosen or "none" in chosen:
                yield "simulated", "none", 0.0, seed
        for seed in arguments.seeds or range(SEEDS):
            for cause in MAKERS[setting(seed)[0]]:
                if not chosen or cause in chosen:
                    for strength in arguments.strengths:
                        yield "simulated", cause, strength, seed
    for name in arguments.real or ((*DISTANT_SETS, *PLANES) if arguments.seeds is None else ()):
        if not chosen or "none" in chosen:
            yield name, "none", 0.0, 0
        for cause in (*(("light_direction",) if name in DISTANT_SETS else ()), *EFFECTS):
            if not chosen or cause in chosen:
                for strength in arguments.strengths:
                    yield name, cause, strength, 0


def read_rows(path: Path | None) -> list[FieldRow]:
    """Read the stored rows; none if the file does not exist."""
    from .judged import FieldRow

    if path is None or not path.exists():
        return []
    found = []
    for line in path.read_text("utf-8").splitlines():
        values = json.loads(line)
        for key in ("named", "ties", "error", "off"):
            values[key] = tuple(values.get(key, ()))
        found.append(FieldRow(**values))
    return found


def table(rows: Sequence[FieldRow]) -> str:
    """Return Markdown tables: all rows, and the counts of right results."""
    lines = [
        "| capture | hidden | RMS change | seed | named | error of held-out regions | time |",
        "|---|---|---|---|---|---|---|",
    ]
    for row in sorted(rows, key=lambda r: (r.source, r.cause, r.wanted, r.seed)):
        about = row.source
        if row.source == "simulated":
            varies = ", albedo varies" if row.varies else ""
            about = f"{row.scan}, {row.material}, {row.lamp}, {row.encoding}{varies}"
        named = ", ".join(row.named) or "none"
        before, after = row.error
        lines.append(
            f"| {about} | {row.cause} | {100 * row.strength:.1f} % | {row.seed} | "
            f"{named if row.right_first else f'**{named}**'} | {100 * before:.1f} → "
            f"{100 * after:.1f} % | {row.seconds:.0f} s |"
        )
    return "\n".join([*lines, "", *_counts(rows), "", *_accuracy(rows)])


def _counts(rows: Sequence[FieldRow]) -> list[str]:
    """Right results of simulated and real captures, by strength."""
    lines = ["| captures | right first | exactly the right set |", "|---|---|---|"]
    for simulated in (True, False):
        some = [row for row in rows if (row.source == "simulated") == simulated]
        for strength in sorted({row.wanted for row in some}):
            mine = [row for row in some if row.wanted == strength]
            what = f"effect of {100 * strength:.0f} %" if strength else "nothing hidden"
            first, exact = (
                sum(getattr(row, name) for row in mine) for name in ("right_first", "right_set")
            )
            kind = "simulated" if simulated else "real photographs"
            lines.append(f"| {kind}, {what} | {first} of {len(mine)} | {exact} of {len(mine)} |")
    return lines


def _accuracy(rows: Sequence[FieldRow]) -> list[str]:
    """Sentences about the parameters and the BRDFs."""
    off = sum(len(row.off) for row in rows)
    inside = sum(row.inside for row in rows)
    ratios = [row.brdf for row in rows if row.brdf is not None]
    if not ratios:
        return []
    middle, worst = np.percentile(ratios, (50, WORST_DECILE))
    return [
        f"{inside} of {off} parameters are in their 95 % interval.",
        "BRDF error of the second fit, divided by that of a fit to photos without the effect: "
        f"median {middle:.2f}, worst decile {worst:.2f} ({len(ratios)} captures).",
    ]
