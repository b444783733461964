"""The last fit, kept while Blender runs. Its report needs photos and rays, which are not stored in
the .blend."""

from __future__ import annotations

from typing import Any

from ...core.jobs import CaptureResult
from .session_state import KeptValue

_last: KeptValue[CaptureResult] = KeptValue()


def keep_fit(result: CaptureResult | None) -> None:
    """Keep a fit in place of the previous one; None to discard it."""
    _last.value = result


def kept_fit(capture: str, described: dict[str, Any] | None) -> CaptureResult | None:
    """The last fit, if it belongs to that capture file and has the coefficients of ``described``,
    the content of result.json; else None. They differ after an undo."""
    last = _last.value
    if last is None or described is None or str(last.capture.file) != capture:
        return None
    stored = [material["coefficients"] for material in described.get("materials", [])]
    own = [material.fit.brdf.coefficients.tolist() for material in last.materials]
    return last if stored == own else None
