"""Localise the photos of a draft that have no camera, as a job."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path

import numpy as np

from ..concurrency.job import Job, Step
from ..concurrency.steps import relayed
from ..counted import counted
from ..errors import InputError
from ..files import atomic_path
from ..scan.scan import with_extra_cameras
from ..solve import Localised, LocaliseJob
from .draft import Draft, LampKind
from .opened_scan import opened_scan
from .propose_lamps import with_lamps

READING, GROUPING = "reading files", "grouping photos by lamp"
READ_SHARE, LOCALISE_SHARE = 0.02, 0.9  # of the job's time, at the ends of these parts
PROPOSED = {LampKind.UNKNOWN, LampKind.FLASH, LampKind.NEAR}  # kinds of lamps that are proposed


class LocaliseDraftJob(Job):
    """Sets ``draft``: photos without a camera get one of their own, and a lamp. Photos that are
    rejected keep none, and a problem says why."""

    def __init__(self, draft: Draft, out: Path) -> None:
        """out: file of cameras to write. Raises InputError where something is missing."""
        super().__init__()
        if draft.cameras is None or draft.mesh is None or draft.images is None:
            raise InputError(
                "photos are localised by comparing them with those of the scan; expected cameras, "
                "mesh and the folder of the scan's own photos: add them first",
                key="images",
            )
        if not draft.without_camera:
            raise InputError("every photo has a camera; expected one without", key="photos")
        self.before, self.out = draft, out
        self.draft: Draft | None = None

    def run(self) -> Iterator[Step]:
        """The steps."""
        yield Step(READING, 0.0)
        draft = self.before
        assert draft.images is not None  # checked by __init__
        opened = opened_scan(draft)
        lost = draft.without_camera
        job = LocaliseJob(opened.scan.cameras, draft.images, lost, opened.scan.mesh)
        share = LOCALISE_SHARE - READ_SHARE
        for step in job.run():
            yield Step(step.stage, READ_SHARE + share * step.fraction)
        result = job.result
        problems = tuple(result.rejected)
        if not result.placed:
            self.draft = replace(draft, problems=problems)
            return
        with atomic_path(self.out, ".part.json") as partial:
            result.write_file(partial, draft.extra)
        by_file = {found.path: found for found in result.placed}
        photos = tuple(
            replace(photo, camera=by_file[photo.file].camera.label, how=_how(by_file[photo.file]))
            if photo.file in by_file
            else photo
            for photo in draft.photos
        )
        scan = opened.scan if draft.extra is None else opened_scan(replace(draft, extra=None)).scan
        opened = replace(opened, scan=with_extra_cameras(scan, self.out))
        sentence = f"{counted(len(by_file), 'photo')} localised"
        draft = replace(
            draft, photos=photos, extra=self.out, problems=problems,
            found=(*draft.found, sentence),
            camera_labels=tuple(camera.label for camera in opened.scan.cameras),
        )  # fmt: skip
        placed_before = {
            p.file for p in draft.photos if p.camera is not None and p.file not in by_file
        }
        if all(lamp.kind in PROPOSED and not lamp.stated for lamp in draft.lamps):
            draft, placed_before = _without_lamps(draft), set()  # all photos are grouped anew
        steps = with_lamps(draft, opened, placed_before)
        self.draft = yield from relayed(
            steps, lambda done: Step(GROUPING, LOCALISE_SHARE + (1 - LOCALISE_SHARE) * done)
        )


def _without_lamps(draft: Draft) -> Draft:
    """The draft without lamps, and without the sentence about them."""
    start = f"{counted(len(draft.lamps), 'lamp')} for "
    found = tuple(line for line in draft.found if not line.startswith(start))
    return replace(draft, lamps=(), found=found)


def _how(found: Localised) -> str:
    return f"localised, ± {np.degrees(found.angle_deviation):.2f}°"
