"""The last fit, while Blender runs: its report needs photos and rays, which no .blend holds."""

from __future__ import annotations

from typing import Any

from ...core.jobs import CaptureResult
from .session_state import Kept

_last: Kept[CaptureResult] = Kept()


def keep_fit(result: CaptureResult | None) -> None:
    """Instead of the one before; None: none."""
    _last.thing = result


def kept_fit(capture: str, described: dict[str, Any] | None) -> CaptureResult | None:
    """The last fit, if it is the one of that capture file that ``described`` (the content of
    result.json) tells of: after an undo it is another."""
    last = _last.thing
    if last is None or described is None or str(last.capture.file) != capture:
        return None
    told = [material["coefficients"] for material in described.get("materials", [])]
    mine = [material.fit.brdf.coefficients.tolist() for material in last.materials]
    return last if told == mine else None
