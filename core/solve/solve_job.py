"""Solve a folder of photos as a job."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path
from typing import Any

from ..concurrency.job import Job, Step, finished
from ..errors import InputError
from ..output_folder import check_out, staged_folder
from .background import Background
from .photo_set import find_photos
from .solution import Solution
from .solve import LENSES, solve

WRITING = "writing the results"  # name of a stage


class SolveJob(Job):
    """Cameras of a folder's photos. The steps follow the progress of a thread; a step takes a tenth
    of a second. Dropping the job, or cancel(), ends the work."""

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
        self.lens, self.threads = lens, threads
        self._work: Background[Solution] | None = None

    @property
    def solution(self) -> Solution:
        """The result; only valid when the job is done."""
        return finished(self._work).result

    def run(self) -> Iterator[Step]:
        """Follow the progress of the thread."""
        self._work = Background(lambda work: solve(self.photos, self.lens, self.threads, work))
        yield from self._work.steps()

    def cancel(self) -> None:
        """Cancel the work and discard its results."""
        if self._steps is not None:
            self._steps.close()  # type: ignore[attr-defined]

    def __getstate__(self) -> dict[str, Any]:
        """Without COLMAP's model, which is in files."""
        return {**super().__getstate__(), "_work": None}


class SolveToFolderJob(Job):
    """Solve a folder of photos and write the result, all of it or nothing. Sets ``report``, the
    text of report.txt, whose first line is ``summary``; ``missing``, the number of photos without a
    pose; ``capture``, the file to continue from; and ``notes``, sentences for the user."""

    def __init__(
        self, folder: Path, out: Path, lens: str = "SIMPLE_RADIAL", threads: int | None = None
    ) -> None:
        """out: folder for the results. Raises InputError, as SolveJob and check_out do."""
        super().__init__()
        self.folder, self.out = folder, check_out(out)
        self.solve = SolveJob(folder, lens, threads)
        self.summary = self.report = ""
        self.missing = 0
        self.capture = out
        self.notes: list[str] = []

    def run(self) -> Iterator[Step]:
        """The steps of the solve; then the files are written."""
        yield from self.solve.run()
        solution = self.solve.solution
        yield Step(WRITING, 1.0)
        with staged_folder(self.out, "solve", self.notes.append) as staging:
            written = solution.write(staging, self.out, self.folder)
        self.summary, self.report = solution.summary(), solution.report()
        self.missing = solution.photos - solution.placed
        self.capture = self.out / written.name
