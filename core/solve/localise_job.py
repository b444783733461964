"""Localise photos as a job, in a background thread."""

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

COMPARED_PHOTOS = (
    40  # photos of the scan, spread over all views, that every new photo is compared with
)
MAX_LENSES = 6
READ_FRACTION = 0.6  # of the job's progress: features of the scan's photos
OUTPUT_FILE = "localised.cameras.json"


@dataclass(frozen=True)
class LocalisedPhotos:
    """placed: localised photos; rejected: a sentence about each photo that was rejected; notes:
    sentences about unused photos. frame: see patina_cameras.py."""

    placed: tuple[Localised, ...]
    rejected: tuple[str, ...]
    notes: tuple[str, ...]
    frame: str

    def write(self, folder: Path) -> Path:
        """Write the file for a capture's ``[scan] extra`` into ``folder``. Returns its path."""
        path = folder / OUTPUT_FILE
        self.write_file(path)
        return path

    def write_file(self, path: Path, earlier: Path | None = None) -> None:
        """The same to a path. earlier: a file whose cameras are kept."""
        statistics = [
            {
                "inliers": found.inliers,
                "error_pixels": found.error,
                "angle_deviation_radians": found.angle_deviation,
                "place_deviation": found.place_deviation,
                "pixel_deviation": found.pixel_deviation,
            }
            for found in self.placed
        ]
        cameras = [found.camera for found in self.placed]
        write_patina_cameras(path, cameras, self.frame, statistics, earlier)


class LocaliseJob(Job):
    """Localise further photos in an existing reconstruction of any format."""

    def __init__(
        self,
        cameras: Sequence[Camera],
        images: Path,
        photos: Sequence[Path],
        mesh: Mesh | None = None,
        model: Path | None = None,
        threads: int | None = None,
    ) -> None:
        """cameras: the scan's, in the mesh's frame; images: folder of the scan's own photos;
        photos: those to localise; mesh: of the scan; model: folder of a COLMAP model, whose sparse
        points are used without a mesh. Raises InputError."""
        super().__init__()
        if not photos:
            raise InputError("found no photos to localise; expected at least one", key="--photos")
        usable = [c for c in cameras if not (c.orthographic or c.panoramic)]
        self._scan, notes = scan_photos(usable, images)
        if not self._scan:
            raise InputError(
                "holds none of the scan's own photos, which are needed for comparison; "
                f"expected names like {cameras[0].label!r}",
                file=images,
                key="--images",
            )
        if mesh is None and model is None:
            raise InputError(
                "no mesh given; cameras of this format need one (only COLMAP's model links points "
                "to photos)",
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
        """The result; only valid when the job is done."""
        return self._work.result

    def run(self) -> Iterator[Step]:
        yield from self._work.steps()

    def cancel(self) -> None:
        """Cancel the work and discard its results."""
        if self._steps is not None:
            self._steps.close()  # type: ignore[attr-defined]

    def _all(self, work: Work) -> LocalisedPhotos:
        lift: Lift
        if self._mesh is not None:
            lift = OnMesh(RayScene.build(self._mesh))
        elif self._model is not None:
            lift = OnSparsePoints(self._model)
        landmarks_of: dict[int, Landmarks] = {}
        unreadable: list[str] = []

        def landmarks(number: int) -> Landmarks:
            work.check()
            if number not in landmarks_of:
                photo = self._scan[number]
                try:
                    landmarks_of[number] = lift.lift(photo.camera, features_of(photo.path))
                except PatinaError as error:
                    unreadable.append(str(error))
                    landmarks_of[number] = Landmarks.none()
            return landmarks_of[number]

        first = spread(self._scan, COMPARED_PHOTOS)
        pool = ThreadPoolExecutor(min(self._threads, 4))
        try:
            for done, _ in enumerate(pool.map(landmarks, first)):
                work.at("reading the scan's photos", READ_FRACTION * (done + 1) / len(first))
        finally:
            pool.shutdown(cancel_futures=True)
        placed: list[Localised] = []
        rejected: list[str] = []
        for place, path in enumerate(self._photos):
            work.at("localising", READ_FRACTION + (1 - READ_FRACTION) * place / len(self._photos))
            try:
                found = localise(
                    path, features_of(path), self._lenses[place], self._scan, first, landmarks, lift
                )
            except Unsupported as error:
                rejected.append(str(error))
                continue
            label = self._labels[place]
            placed.append(replace(found, camera=replace(found.camera, label=label)))
        frame = "mesh" if self._mesh is not None else "cameras"
        return LocalisedPhotos(tuple(placed), tuple(rejected), (*self._notes, *unreadable), frame)


def features_of(path: Path) -> Features:
    """Features of the photo after contrast equalisation, which makes a single lamp and even light
    comparable. Raises InputError."""
    return Detector(pooled=True)(even_contrast(grey_of(read_picture(path))))


def _lenses(scan: Sequence[ScanPhoto], path: Path) -> list[Camera]:
    """The scan's lenses that fit a photo of that size, most used first."""
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
            f"is {size[0]} × {size[1]} pixels; expected a size of the scan's photos, "
            f"{', '.join(sizes[:5])}; take "
            "it with a lens of the scan at the same focal length, and do not crop it",
            file=path,
        )
    return [group[0] for group in sorted(used.values(), key=len, reverse=True)[:MAX_LENSES]]


def _labels(photos: Sequence[Path], used_labels: set[str]) -> list[str]:
    """A label for each photo that neither the scan nor another of them uses."""
    labels: list[str] = []
    for path in photos:
        resolved = path.resolve()
        choices = [resolved.name, f"{resolved.parent.name}/{resolved.name}"]
        choices += [f"{n}/{resolved.name}" for n in range(2, len(photos) + 3)]
        label = next(name for name in choices if name not in used_labels)
        used_labels = used_labels | {label}
        labels.append(label)
    return labels
