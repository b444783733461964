"""Solve the cameras of a draft from its photos, as a job."""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterator, Sequence
from dataclasses import replace
from pathlib import Path

from ..concurrency.job import Job, Step
from ..counted import counted
from ..solve import SolveToFolderJob
from ..solve.solution import MODEL
from .draft import Draft
from .draft_job import DraftJob

SOLVE_SHARE = 0.9  # of the job's time


def photo_folders(photos: Sequence[Path]) -> tuple[tuple[Path, int], ...]:
    """(folder, number of photos in it) of a draft's photos, the largest number first."""
    return tuple(Counter(photo.parent for photo in photos).most_common())


class SolveDraftJob(Job):
    """Sets ``draft``: with the cameras of the photos in one folder, to which the photos of the
    others are matched. ``summary`` states what was solved."""

    def __init__(self, draft: Draft, folder: Path, out: Path | None = None) -> None:
        """folder: of the photos to solve. out: folder for the result; None: next to it, its name
        followed by "solved". Raises InputError."""
        super().__init__()
        self.before, self.folder = draft, folder
        self._solve = SolveToFolderJob(folder, out or folder.with_name(f"{folder.name} solved"))
        self.out = self._solve.out
        self.draft: Draft | None = None
        self.summary = ""

    def run(self) -> Iterator[Step]:
        """The steps."""
        for step in self._solve.run():
            yield Step(step.stage, SOLVE_SHARE * step.fraction)
        self.summary, missing = self._solve.summary, self._solve.missing
        files = [photo.file for photo in self.before.photos]
        others = [file for file in files if file.parent != self.folder]
        draft = replace(self.before, photos=tuple(
            photo for photo in self.before.photos if photo.file.parent != self.folder or not others
        ))  # fmt: skip
        draft = replace(draft, images=self.folder)
        match = DraftJob([self.out / MODEL], draft)
        for step in match.run():
            yield Step(step.stage, SOLVE_SHARE + (1 - SOLVE_SHARE) * step.fraction)
        assert match.draft is not None  # the job ran to its end
        problem = f"{counted(missing, 'photo')} of the scan without a pose: see report.txt"
        problems = (*match.draft.problems, problem) if missing else match.draft.problems
        self.draft = replace(match.draft, problems=problems)
