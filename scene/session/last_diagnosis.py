"""The last check, while Blender runs: a second fit needs its samples, which no .blend holds."""

from __future__ import annotations

from ...core.jobs.diagnose_job import DiagnoseJob
from .session_state import Kept

_last: Kept[DiagnoseJob] = Kept()


def keep(job: DiagnoseJob | None) -> None:
    """Instead of the one before; None: none."""
    _last.thing = job


def kept(capture: str) -> DiagnoseJob | None:
    """The last check, if it was of that capture file."""
    last = _last.thing
    if last is None or last.result is None or str(last.result.capture.file) != capture:
        return None
    return last
