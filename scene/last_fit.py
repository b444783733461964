"""The last fit, while Blender runs: its report needs photos and rays, which no .blend holds."""

from __future__ import annotations

from typing import Any

import bpy

from ..core.job import CaptureResult
from .handlers import attach, detach

_last: CaptureResult | None = None


def keep_fit(result: CaptureResult | None) -> None:
    """Instead of the one before; None: none."""
    global _last
    _last = result


def kept_fit(capture: str, described: dict[str, Any] | None) -> CaptureResult | None:
    """The last fit, if it is the one of that capture file that ``described`` (the content of
    result.json) tells of: after an undo it is another."""
    if _last is None or described is None or str(_last.capture.file) != capture:
        return None
    told = [material["coefficients"] for material in described.get("materials", [])]
    mine = [material.fit.brdf.coefficients.tolist() for material in _last.materials]
    return _last if told == mine else None


@bpy.app.handlers.persistent
def _forget(*_: object) -> None:
    """Another file is opened."""
    keep_fit(None)


HANDLERS = (("load_pre", _forget),)


def register() -> None:
    """Watch for another file."""
    attach(HANDLERS)


def unregister() -> None:
    """No more, and forget the last fit."""
    detach(HANDLERS)
    keep_fit(None)
