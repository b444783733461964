"""Write shadow masks to a folder, all of them or none, as a job."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path

from ..capture import Capture
from ..concurrency.job import Job, Step
from ..output_folder import staged_folder
from .write_masks import MasksJob, MasksSettings, WrittenMasks


class StagedMasksJob(Job):
    """Write the shadow masks of a capture to the folder ``out``. Sets ``result``; ``notes`` are
    sentences for the user."""

    def __init__(self, capture: Capture, out: Path) -> None:
        super().__init__()
        self.capture, self.out = capture, out
        self.notes: list[str] = []
        self.result: WrittenMasks | None = None

    def run(self) -> Iterator[Step]:
        """Run a MasksJob in a temporary folder, then move the files into place."""
        with staged_folder(self.out, "masks", self.notes.append) as folder:
            job = MasksJob(self.capture, MasksSettings(), folder, self.out)
            yield from job.run()
        self.result = job.result
