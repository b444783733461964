"""Queries on records, for tables and figures."""

from __future__ import annotations

from collections.abc import Iterable
from typing import Any

import numpy as np

Record = dict[str, Any]


def where(records: Iterable[Record], **wanted: Any) -> list[Record]:
    """Return the records with all of these values."""
    return [r for r in records if all(r.get(k) == v for k, v in wanted.items())]


def values(records: Iterable[Record], key: str) -> list[float]:
    """Return the finite values of a key; records without one are skipped."""
    found = [r[key] for r in records if isinstance(r.get(key), int | float)]
    return [float(v) for v in found if np.isfinite(v)]


def median(records: Iterable[Record], key: str) -> float:
    """Return the median of the values of a key; NaN if there are none."""
    found = values(records, key)
    return float(np.median(found)) if found else float("nan")


def distinct(records: Iterable[Record], key: str) -> list[Any]:
    """Return the distinct values of a key in the order of their first appearance."""
    return list(dict.fromkeys(r[key] for r in records if key in r))


def per_case(records: Iterable[Record], key: str) -> dict[tuple[str, str], float]:
    """Return (material, scene) → median over seeds."""
    groups: dict[tuple[str, str], list[float]] = {}
    for r in records:
        if isinstance(r.get(key), int | float) and np.isfinite(r[key]):
            groups.setdefault((r["material"], r["scene"]), []).append(float(r[key]))
    return {case: float(np.median(v)) for case, v in groups.items()}


def ratios(
    above: Iterable[Record], below: Iterable[Record], key: str
) -> dict[tuple[str, str], float]:
    """Return (material, scene) → ratio of the medians, for the cases in both sets of records."""
    a, b = per_case(above, key), per_case(below, key)
    return {case: a[case] / b[case] for case in a if case in b and b[case] > 0}


def table(head: list[str], rows: Iterable[Iterable[str]]) -> str:
    """Return a Markdown table."""
    lines = ["| " + " | ".join(head) + " |", "|" + "---|" * len(head)]
    return "\n".join([*lines, *("| " + " | ".join(row) + " |" for row in rows)]) + "\n"


def number(x: float, digits: int = 3) -> str:
    """Format a value for a table; – if it is not finite."""
    if not np.isfinite(x):
        return "–"
    return f"{x:.0f}" if abs(x) >= 100 else f"{x:.{digits - (abs(x) >= 10) - (abs(x) >= 1)}f}"
