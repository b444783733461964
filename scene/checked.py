"""The last check, while Blender runs: a second fit needs its samples, which no .blend holds."""

from __future__ import annotations

import bpy

from ..core.job.diagnose_job import DiagnoseJob
from .handlers import attach, detach

_last: DiagnoseJob | None = None


def keep(job: DiagnoseJob | None) -> None:
    """Instead of the one before; None: none."""
    global _last
    _last = job


def kept(capture: str) -> DiagnoseJob | None:
    """The last check, if it was of that capture file."""
    if _last is None or _last.result is None or str(_last.result.capture.file) != capture:
        return None
    return _last


@bpy.app.handlers.persistent
def _forget(*_: object) -> None:
    """Another file is opened."""
    keep(None)


HANDLERS = (("load_pre", _forget),)


def register() -> None:
    """Watch for another file."""
    attach(HANDLERS)


def unregister() -> None:
    """No more, and forget the last check."""
    detach(HANDLERS)
    keep(None)
