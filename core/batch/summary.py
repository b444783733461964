"""What a page about many objects says of one: read from its result."""

from __future__ import annotations

import json
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any
from urllib.parse import quote

from ..diagnose.effects.labels import LABELS
from .collection import Item

MAX_JSON_BYTES = 1 << 28
FINISHED, FAILED, WAITING = "finished", "failed", "waiting"


@dataclass(frozen=True)
class Cause:
    """A cause that a diagnosis tried. named: whether it was accepted; parameters: name → (value,
    standard error, unit)."""

    name: str
    named: bool
    parameters: dict[str, tuple[float, float, str]] = field(default_factory=dict)

    @property
    def label(self) -> str:
        """Its name for users."""
        return LABELS.get(self.name, self.name.replace("_", " "))


@dataclass(frozen=True)
class Summary:
    """One object. state: FINISHED, FAILED or WAITING. typical: error of a held-out photo, for
    the worst material; None if unknown. normals: RMS error of the scan's normals, degrees, None
    without a diagnosis. causes: those that the diagnosis tried; None without a diagnosis. sphere,
    report: links relative to the folder of the batch. error: why it failed."""

    item: Item
    state: str = WAITING
    materials: tuple[str, ...] = ()
    typical: float | None = None
    normals: float | None = None
    causes: tuple[Cause, ...] | None = None
    warnings: tuple[str, ...] = ()
    sphere: str | None = None
    report: str | None = None
    seconds: float = 0.0
    peak_mb: float = 0.0
    attempts: int = 0
    error: str = ""


def summary_of(
    out: Path, item: Item, seconds: float, peak_mb: float, attempts: int, error: str
) -> Summary:
    """The summary of an object that has ended. out: folder of the batch."""
    if error:
        return Summary(
            item, FAILED, seconds=seconds, peak_mb=peak_mb, attempts=attempts, error=error
        )
    folder = out / item.name
    result, diagnosis = _read(folder / "result.json"), _read(folder / "diagnosis.json")
    materials = result.get("materials") or []
    errors = [(one.get("held_out") or {}).get("typical") for one in materials]
    known = [float(e) for e in errors if e is not None]
    spheres = sorted(folder.glob("report/**/sphere_*.png"))
    pages = sorted(folder.glob("report/**/index.html"), key=lambda p: len(p.parts))
    quality = diagnosis.get("scan_quality") or {}
    return Summary(
        item,
        FINISHED,
        materials=tuple(str(one.get("name")) for one in materials),
        typical=max(known, default=None),
        normals=_number(quality.get("normals")),
        causes=_causes(diagnosis) if diagnosis else None,
        warnings=tuple(str(w) for w in result.get("warnings") or ()),
        sphere=_link(spheres[0], out) if spheres else None,
        report=_link(pages[0], out) if pages else None,
        seconds=seconds,
        peak_mb=peak_mb,
        attempts=attempts,
    )


def _causes(diagnosis: dict[str, Any]) -> tuple[Cause, ...]:
    named = set(diagnosis.get("named") or ()) - {"none"}
    tried = {one["cause"]: one.get("parameters") or {} for one in diagnosis.get("causes") or ()}
    return tuple(
        Cause(
            name,
            name in named,
            {
                key: (float(one["value"]), float(one["standard_error"]), str(one["unit"]))
                for key, one in tried.get(name, {}).items()
            },
        )
        for name in sorted({*tried, *named})
    )


def _number(value: Any) -> float | None:
    return float(value) if isinstance(value, int | float) else None


def _link(path: Path, out: Path) -> str:
    return quote(path.relative_to(out).as_posix())


def _read(path: Path) -> dict[str, Any]:
    """A JSON object, {} where there is none."""
    try:
        if path.stat().st_size > MAX_JSON_BYTES:
            return {}
        found = json.loads(path.read_bytes())
    except (OSError, ValueError):
        return {}
    return found if isinstance(found, dict) else {}
