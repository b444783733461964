"""Solve a folder of photos as a job; the steps only report the progress of a thread."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path

from ..concurrency.job import Job, Step
from ..errors import InputError
from .background import Background
from .photo_set import find_photos
from .solution import Solution
from .solve import LENSES, solve


class SolveJob(Job):
    """Cameras of a folder's photos. The work runs in a thread that never uses bpy; a step takes a
    tenth of a second. Dropping the job, or cancel(), ends the work."""

    def __init__(
        self, folder: Path, lens: str = "SIMPLE_RADIAL", threads: int | None = None
    ) -> None:
        """lens: the camera model, one of LENSES. threads: maximum number of threads; None: all
        cores. Raises InputError where the folder or the lens does not exist."""
        super().__init__()
        if lens not in LENSES:
            raise InputError(f"found {lens!r}; expected one of {', '.join(LENSES)}", key="--lens")
        self.photos = find_photos(folder)
        if not self.photos:
            raise InputError("holds no photos; expected at least 3", file=folder)
        self._work = Background(lambda work: solve(self.photos, lens, threads, work))

    @property
    def solution(self) -> Solution:
        """The result; only valid when the job is done."""
        return self._work.result

    def run(self) -> Iterator[Step]:
        yield from self._work.steps()

    def cancel(self) -> None:
        """Cancel the work and discard its results."""
        if self._steps is not None:
            self._steps.close()  # type: ignore[attr-defined]
