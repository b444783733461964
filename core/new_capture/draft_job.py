"""Read the files of a new capture and propose the rest, as a job."""

from __future__ import annotations

from collections.abc import Generator, Iterator, Sequence
from dataclasses import replace
from pathlib import Path

from ..concurrency.job import Job, Step
from ..concurrency.steps import relayed
from ..counted import counted, listed
from ..errors import PatinaError
from ..photo import Transfer, read_photo
from ..scan import Camera
from . import match_names
from .draft import Draft, DraftPhoto
from .match_photos import matched
from .opened_scan import OpenedScan, opened_scan, with_scan_checked
from .propose_lamps import with_lamps
from .recognise import best_cameras, best_mesh, readable_photos, sort_paths, tool_name

READING, MATCHING, GROUPING = "reading files", "matching photos", "grouping photos by lamp"
READ_SHARE, MATCH_SHARE = 0.08, 0.25  # of the job's time, at the ends of these parts
SCAN_PHOTO_SHARE = 0.8  # of the cameras that a folder holds the photos of, to be the scan's photos


class DraftJob(Job):
    """Sets ``draft``. paths: files and folders; before: a draft whose files are kept, unless
    ``paths`` holds newer ones of the kind."""

    def __init__(self, paths: Sequence[Path], before: Draft | None = None) -> None:
        super().__init__()
        self.paths, self.before = tuple(paths), before or Draft()
        self.draft: Draft | None = None

    def run(self) -> Iterator[Step]:
        """The steps."""
        yield Step(READING, 0.0)
        draft = self._read()
        opened: OpenedScan | None = None
        if draft.cameras is not None and draft.mesh is not None:
            yield Step(READING, 0.5 * READ_SHARE)
            try:
                opened = opened_scan(draft)
            except PatinaError as error:
                draft = replace(draft, problems=(*draft.problems, str(error)))
            else:
                draft = with_scan_checked(draft, opened)
        seen = {photo.file for photo in self.before.photos}
        if opened is not None and draft.photos:
            draft = yield from _staged(
                matched(draft, opened, {*self.paths, *seen}), MATCHING, READ_SHARE, MATCH_SHARE
            )
            kept = seen if draft.lamps else set()
            steps = with_lamps(draft, opened, kept)
            draft = yield from _staged(steps, GROUPING, MATCH_SHARE, 1.0)
        self.draft = draft

    def _read(self) -> Draft:
        """Sort the files. Raises InputError for a path that does not exist."""
        files = sort_paths(self.paths)
        before = self.before
        found: list[str] = []
        problems: list[str] = []
        cameras, why = best_cameras(files.cameras)
        extra = files.localised[0] if files.localised else None
        if cameras is None:
            problems += why
        mesh, surface, why = best_mesh(files.meshes)
        if mesh is None:
            problems += why
        photos, why = readable_photos(files.photos)
        if why:
            problems.append(f"{len(why)} photos cannot be read: {listed(why)}")
        path = cameras.path if cameras is not None else before.cameras
        if cameras is not None:
            found.append(f"{counted(len(cameras.cameras), 'camera')}, {tool_name(cameras.path)}")
        if surface is not None and mesh is not None:
            found.append(f"Mesh of {len(surface.faces):,} faces ({mesh.name})")
        images, lit = _scan_photos(photos, () if cameras is None else cameras.cameras)
        if images is not None:
            found.append(f"Photos of the scan in {images.name}")
        if cameras is None:
            extra = extra or before.extra
        kept = [photo for photo in before.photos if photo.file not in lit]
        if cameras is not None and cameras.path != before.cameras:
            kept = [replace(photo, camera=None, how="") for photo in kept]  # they were of others
        drafted = (*kept, *(DraftPhoto(photo) for photo in lit))
        if lit:
            found.append(_photo_sentence(lit))
        return Draft(
            path, mesh or before.mesh, images or before.images, drafted, before.lamps,
            tuple(found), tuple(problems), extra=extra,
        )  # fmt: skip


def _photo_sentence(photos: Sequence[Path]) -> str:
    """Number, format and encoding of the photos."""
    kinds = sorted({photo.suffix.lstrip(".").upper() for photo in photos})
    try:
        encoding = read_photo(photos[0], Transfer.named("auto")).info.transfer.name
        encoding = {"srgb": "sRGB"}.get(encoding, encoding)
    except PatinaError:
        encoding = ""
    count = counted(len(photos), "photo")
    return f"{count}, {', '.join(kinds)}" + (f", {encoding}" if encoding else "")


def _scan_photos(
    photos: Sequence[Path], cameras: Sequence[Camera]
) -> tuple[Path | None, list[Path]]:
    """(folder with the scan's own photos, the others). A folder that holds the photos of most
    cameras is the scan's, if another folder holds photos too; else its photos are the lit ones."""
    folders = list(dict.fromkeys(photo.parent for photo in photos))
    if len(folders) > 1 and cameras:
        for folder in folders:
            inside = [photo for photo in photos if photo.parent == folder]
            named = set(match_names.by_name(inside, cameras).values())
            if len(named) >= SCAN_PHOTO_SHARE * len(cameras):
                return folder, [photo for photo in photos if photo.parent != folder]
    return None, list(photos)


def _staged(
    steps: Generator[float, None, Draft], stage: str, start: float, end: float
) -> Generator[Step, None, Draft]:
    """The steps of one part of the job, between two fractions."""
    return relayed(steps, lambda done: Step(stage, start + (end - start) * done))
