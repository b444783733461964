"""Write the report of a fit, as a job."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path

from ..concurrency.job import Job, Step
from ..jobs import CaptureResult
from .page import write_report

WRITING = "writing the report"  # name of the stage


class ReportJob(Job):
    """Write the report of a fit into a folder."""

    def __init__(self, fit: CaptureResult, folder: Path) -> None:
        super().__init__()
        self.fit, self.folder = fit, folder

    def run(self) -> Iterator[Step]:
        """One step for each material and each photo."""
        for fraction in write_report(self.folder, self.fit):
            yield Step(WRITING, fraction)
