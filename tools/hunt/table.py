"""`run.py hunt`: diagnose captures with a hidden effect (docs/notebook/hidden-effects.md).

Every row is stored in a file when it is computed, so that the table can be made in several runs.
"""

from __future__ import annotations

import argparse
import json
import sys
from collections import Counter, defaultdict
from collections.abc import Iterator, Sequence
from dataclasses import asdict
from pathlib import Path
from typing import TYPE_CHECKING

from ..common import say
from ..package import load_patina
from .plan import NONES, SEEDS, STRENGTHS, captures
from .state import state

if TYPE_CHECKING:
    from .judged import Row


def main() -> int:
    """Make and diagnose captures; print one line per capture, then the tables. With --field or
    --evidence first: captures of scans as they are (tools/field_hunt)."""
    if sys.argv[1:2] == ["--field"]:
        from ..field_hunt import table as field_table

        return field_table.main(sys.argv[2:])
    if sys.argv[1:2] == ["--evidence"]:
        from ..field_hunt import evidence

        return evidence.main(sys.argv[2:])
    load_patina()
    from .judged import judged
    from .make import MAKERS, ON_PICTURES, OUTSIDERS

    parser = argparse.ArgumentParser(prog="run.py hunt", description=__doc__)
    parser.add_argument("causes", nargs="*", help=f"none, {', '.join((*MAKERS, *OUTSIDERS))}, "
                        f"or two joined by +, the second of {', '.join(ON_PICTURES)}; "
                        "default: the full table")  # fmt: skip
    parser.add_argument("--strengths", type=float, nargs="+", default=STRENGTHS, metavar="RMS",
                        help="RMS changes of the photos, for the given causes")  # fmt: skip
    parser.add_argument("--seeds", type=int, nargs="+",
                        help=f"default: 1 to {SEEDS}, in the full table 1 to {NONES}")  # fmt: skip
    parser.add_argument("--rows", type=Path, metavar="FILE", help="stored rows (JSON lines): "
                        "these are not computed again, and new ones are added")  # fmt: skip
    parser.add_argument("--threads", type=int, metavar="N")
    parser.add_argument("--only-print", action="store_true", help="print the stored rows only")
    arguments = parser.parse_args()
    known = {"none", *MAKERS, *OUTSIDERS}
    unknown = [c for c in arguments.causes if not known.issuperset(c.split("+"))]
    if unknown:
        parser.error(f"found {unknown[0]!r}, expected none, {', '.join(MAKERS)}")
    rows = read_rows(arguments.rows)
    wanted = [] if arguments.only_print else list(_wanted(arguments, tuple(MAKERS)))
    for cause, strength, seed in wanted:
        if any((r.cause, r.wanted, r.seed) == (cause, strength, seed) for r in rows):
            continue
        row = judged(cause, strength, seed, arguments.threads)
        rows.append(row)
        named = ", ".join(row.named) or "none"
        say(f"{cause} at {100 * strength:.0f} %, seed {seed}: {named}")
        if arguments.rows is not None:
            with arguments.rows.open("a", encoding="utf-8") as file:
                file.write(json.dumps(asdict(row)) + "\n")
    print(table(rows))
    return 0


def _wanted(
    arguments: argparse.Namespace, vocabulary: Sequence[str]
) -> Iterator[tuple[str, float, int]]:
    """Yield (cause, strength, seed), ordered by seed so that shared renders are reused."""
    if not arguments.causes:
        yield from captures(vocabulary, arguments.seeds or range(1, NONES + 1))
        return
    for seed in arguments.seeds or range(1, SEEDS + 1):
        for cause in arguments.causes:
            for strength in arguments.strengths if cause != "none" else (0.0,):
                yield cause, strength, seed


def read_rows(path: Path | None) -> list[Row]:
    """Read the stored rows; none if the file does not exist."""
    from .judged import Row

    if path is None or not path.exists():
        return []
    found = []
    for line in path.read_text("utf-8").splitlines():
        values = json.loads(line)
        for key in ("named", "ties", "off", "seconds"):
            values[key] = tuple(values[key])
        found.append(Row(**values))
    return found


def table(rows: Sequence[Row]) -> str:
    """Return Markdown tables: all rows, the counts of right results, and the confusions.

    If an effect cannot be as strong as requested, two strengths share one capture, which counts
    once.
    """
    rows = _distinct(rows)
    lines = [
        "| hidden | RMS change | seed | named | gain | BRDF error ÷ without effect | error ÷ floor "
        "| in interval | made | diagnosed | state |",
        "|---|---|---|---|---|---|---|---|---|---|---|",
    ]
    for row in sorted(rows, key=lambda r: (r.cause, r.wanted, r.seed)):
        named = ", ".join(row.named) or "none"
        if row.ties:
            named += f" (or {', '.join(row.ties)})"
        brdf = "–" if row.brdf is None else f"{row.brdf:.2f}"
        if row.brdf_before is not None:
            brdf = f"{row.brdf_before:.2f} → {brdf}"
        inside = f"{row.inside} of {len(row.off)}" if row.off else "–"
        made, took = row.seconds
        lines.append(
            f"| {row.cause} | {100 * row.strength:.1f} % | {row.seed} | "
            f"{named if row.right else f'**{named}**'} | {row.gain:.1f} | {brdf} | "
            f"{row.over_floor:.2f} | {inside} | {made:.0f} s | {took:.0f} s | {row.state or '–'} |"
        )
    return "\n".join([*lines, "", *_sums(rows), "", *_confusion(rows)])


def _distinct(rows: Sequence[Row]) -> list[Row]:
    """Return the rows without those that repeat the capture of a smaller requested strength."""
    kept: dict[tuple[str, int, float], Row] = {}
    for row in sorted(rows, key=lambda r: r.wanted):
        kept.setdefault((row.cause, row.seed, row.strength), row)
    return list(kept.values())


def _sums(rows: Sequence[Row]) -> list[str]:
    groups: dict[str, list[Row]] = defaultdict(list)
    for row in rows:
        if row.cause == "none":
            group = "none: no cause named"
        elif row.hidden == {"unknown"}:
            group = "unlisted effects: `unknown`"
        elif "+" in row.cause:
            group = "pairs: both causes and no third"
        else:
            group = f"right cause first, at {100 * row.wanted:.0f} %"
        groups[group].append(row)
    lines = ["| captures | right | wrong cause named |", "|---|---|---|"]
    for group, mine in sorted(groups.items()):
        right, wrong = sum(r.right for r in mine), sum(r.wrong_name for r in mine)
        lines.append(f"| {group} | {right} of {len(mine)} | {wrong} |")
    count = sum(len(row.off) for row in rows)
    if count:
        inside = sum(row.inside for row in rows)
        lines.append(f"| parameters within their 95 % interval | {inside} of {count} | |")
    ratios = sorted(row.brdf for row in rows if row.brdf is not None and row.right)
    if ratios:
        within = sum(ratio <= 1.2 for ratio in ratios)
        text = f"{within} of {len(ratios)} (median {ratios[len(ratios) // 2]:.2f})"
        lines.append(f"| BRDF error ÷ without the effect ≤ 1.2, where right | {text} | |")
    within = sum(row.over_floor <= 1.1 for row in rows)
    lines.append(f"| error of held-out regions ÷ noise floor ≤ 1.1 | {within} of {len(rows)} | |")
    present = state()
    mine = sum(row.state == present for row in rows)
    lines.append(f"| rows computed by the current code, {present} | {mine} of {len(rows)} | |")
    return lines


def _confusion(rows: Sequence[Row]) -> list[str]:
    """Count which cause is named first for each single hidden cause, over all strengths."""
    counts: dict[str, Counter[str]] = defaultdict(Counter)
    for row in rows:
        if "+" not in row.cause:
            counts[row.cause][(row.named or ("none",))[0]] += 1
    lines = ["| hidden | named first |", "|---|---|"]
    for cause, found in sorted(counts.items()):
        text = ", ".join(f"{name} {count}" for name, count in found.most_common())
        lines.append(f"| {cause} | {text} |")
    return lines


if __name__ == "__main__":
    sys.exit(main())
