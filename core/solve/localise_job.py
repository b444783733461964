"""Localising photos as a job; the work is in a thread, as solving is."""

from __future__ import annotations

import os
from collections.abc import Iterator, Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass, replace
from pathlib import Path

from ..concurrency.job import Job, Step
from ..errors import InputError, PatinaError
from ..geometry import RayScene
from ..photo import image_size
from ..scan import Camera, Mesh
from ..scan.readers.patina_cameras import write_patina_cameras
from .background import Background, Work
from .features import Detector, Features
from .landmarks import Landmarks, OnMesh, OnSparsePoints
from .localise import Lift, Localised, Unsupported, localise
from .picture import even_contrast, grey_of, read_picture
from .scan_photos import ScanPhoto, scan_photos, spread

LOOKED_AT = 40  # photos of the scan, spread over all, that every new photo is compared with
MOST_LENSES = 6
READ = 0.6  # of the whole job: features of the scan's photos
OUT = "localised.cameras.json"


@dataclass(frozen=True)
class LocalisedPhotos:
    """placed; refused: a sentence each; notes: what was not of use. frame: see patina_cameras."""

    placed: tuple[Localised, ...]
    refused: tuple[str, ...]
    notes: tuple[str, ...]
    frame: str

    def write(self, folder: Path) -> Path:
        """The file that a capture's ``[scan] extra`` names. Returns its path."""
        path = folder / OUT
        more = [
            {
                "inliers": found.inliers,
                "error_pixels": found.error,
                "angle_deviation_radians": found.angle_deviation,
                "place_deviation": found.place_deviation,
                "pixel_deviation": found.pixel_deviation,
            }
            for found in self.placed
        ]
        write_patina_cameras(path, [found.camera for found in self.placed], self.frame, more)
        return path


class LocaliseJob(Job):
    """Poses for extra photos in an existing reconstruction of any format."""

    def __init__(
        self,
        cameras: Sequence[Camera],
        images: Path,
        photos: Sequence[Path],
        mesh: Mesh | None = None,
        model: Path | None = None,
        threads: int | None = None,
    ) -> None:
        """cameras: the scan's, in the mesh's frame; images: the folder of the scan's own photos;
        photos: those to place; mesh, or model: a COLMAP model's folder, whose sparse points then
        stand in. Raises InputError."""
        super().__init__()
        if not photos:
            raise InputError("no photos to localise", key="--photos")
        usable = [c for c in cameras if not (c.orthographic or c.panoramic)]
        self._scan, notes = scan_photos(usable, images)
        if not self._scan:
            raise InputError(
                "none of the scan's own photos lies here: a new photo is found by comparing it "
                f"with them (expected names like {cameras[0].label!r})",
                file=images,
                key="--images",
            )
        if mesh is None and model is None:
            raise InputError(
                "a mesh is needed for cameras of this format (only COLMAP's model has points with "
                "their photos)",
                key="--mesh",
            )
        self._lenses = [_lenses(self._scan, path) for path in photos]
        self._labels = _labels(photos, {camera.label for camera in cameras})
        self._notes, self._photos = tuple(notes), list(photos)
        self._mesh, self._model = mesh, model
        self._threads = threads or os.cpu_count() or 1
        self._work = Background(self._all)

    @property
    def result(self) -> LocalisedPhotos:
        """Only when the job is done."""
        return self._work.result

    def run(self) -> Iterator[Step]:
        yield from self._work.steps()

    def cancel(self) -> None:
        """Let the work end; what it had found so far is thrown away."""
        if self._steps is not None:
            self._steps.close()  # type: ignore[attr-defined]

    def _all(self, work: Work) -> LocalisedPhotos:
        lift: Lift
        if self._mesh is not None:
            lift = OnMesh(RayScene.build(self._mesh))
        elif self._model is not None:
            lift = OnSparsePoints(self._model)
        shown: dict[int, Landmarks] = {}
        bad: list[str] = []

        def landmarks(number: int) -> Landmarks:
            work.check()
            if number not in shown:
                photo = self._scan[number]
                try:
                    shown[number] = lift.lift(photo.camera, features_of(photo.path))
                except PatinaError as error:
                    bad.append(str(error))
                    shown[number] = Landmarks.none()
            return shown[number]

        first = spread(self._scan, LOOKED_AT)
        pool = ThreadPoolExecutor(min(self._threads, 4))
        try:
            for done, _ in enumerate(pool.map(landmarks, first)):
                work.at("reading the scan's photos", READ * (done + 1) / len(first))
        finally:
            pool.shutdown(cancel_futures=True)
        placed: list[Localised] = []
        refused: list[str] = []
        for place, path in enumerate(self._photos):
            work.at("localising", READ + (1 - READ) * place / len(self._photos))
            try:
                found = localise(
                    path, features_of(path), self._lenses[place], self._scan, first, landmarks, lift
                )
            except Unsupported as error:
                refused.append(str(error))
                continue
            label = self._labels[place]
            placed.append(replace(found, camera=replace(found.camera, label=label)))
        frame = "mesh" if self._mesh is not None else "cameras"
        return LocalisedPhotos(tuple(placed), tuple(refused), (*self._notes, *bad), frame)


def features_of(path: Path) -> Features:
    """What is compared: features of the photo with its contrast made even, so that one lamp and
    even light leave the same. Raises InputError."""
    return Detector(pooled=True)(even_contrast(grey_of(read_picture(path))))


def _lenses(scan: Sequence[ScanPhoto], path: Path) -> list[Camera]:
    """The scan's lenses a photo of that size may have been taken with, most used first."""
    size = image_size(path)
    used: dict[tuple[object, ...], list[Camera]] = {}
    for photo in scan:
        try:
            camera = photo.camera.resized(*size)
        except PatinaError:
            continue
        used.setdefault((camera.model, camera.parameters), []).append(camera)
    if not used:
        sizes = sorted({f"{p.camera.width} × {p.camera.height}" for p in scan})
        raise InputError(
            f"is {size[0]} × {size[1]} pixels; the scan's photos are {', '.join(sizes[:5])}: take "
            "it with a lens of the scan, at the same focal length, and do not crop it",
            file=path,
        )
    return [group[0] for group in sorted(used.values(), key=len, reverse=True)[:MOST_LENSES]]


def _labels(photos: Sequence[Path], taken: set[str]) -> list[str]:
    """A name for each that neither the scan nor another of them has."""
    labels: list[str] = []
    for path in photos:
        resolved = path.resolve()
        choices = [resolved.name, f"{resolved.parent.name}/{resolved.name}"]
        choices += [f"{n}/{resolved.name}" for n in range(2, len(photos) + 3)]
        label = next(name for name in choices if name not in taken)
        taken = taken | {label}
        labels.append(label)
    return labels
