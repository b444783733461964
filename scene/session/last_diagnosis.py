"""The last check, kept while Blender runs. Fit Again needs its samples, which are not stored in the
.blend."""

from __future__ import annotations

from ...core.jobs.diagnose_job import DiagnoseJob
from .session_state import KeptValue

_last: KeptValue[DiagnoseJob] = KeptValue()


def keep_check(job: DiagnoseJob | None) -> None:
    """Keep a check in place of the previous one; None to discard it."""
    _last.value = job


def kept_check(capture: str) -> DiagnoseJob | None:
    """The last check, if it belongs to that capture file; else None."""
    last = _last.value
    if last is None or last.result is None or str(last.result.capture.file) != capture:
        return None
    return last
