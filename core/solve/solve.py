"""Structure from motion: photos → cameras and sparse points, by COLMAP's incremental mapper
(Schönberger & Frahm 2016). Runs in a thread, see background.py."""

from __future__ import annotations

import os
from collections.abc import Iterator, Sequence
from concurrent.futures import ThreadPoolExecutor
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import pycolmap
from numpy.typing import NDArray

from ..counted import counted
from ..errors import PatinaError
from ..output_folder import scratch_folder
from ..photo import read_exif
from .background import Work
from .database import FeatureStore
from .features import Detector, Features
from .pairs import LARGEST_FEATURES, choose_pairs
from .photo_set import LensKey, PhotoFile, first_focal
from .picture import grey_of, read_picture
from .solution import Solution, Unplaced

LENSES = ("SIMPLE_RADIAL", "RADIAL", "OPENCV", "OPENCV_FISHEYE", "SIMPLE_PINHOLE", "PINHOLE")
MIN_PHOTOS = 3  # two photos cannot be verified by a third
PAIRS_PER_BATCH = 100  # matched between two checks for cancellation
MAX_PARALLEL_PHOTOS = 4  # each takes a gigabyte at the largest side that features use
EXTRACTED_FRACTION, PAIRED_FRACTION, MATCHED_FRACTION = 0.45, 0.5, 0.8  # of the job's progress
OVERLAP_ADVICE = (
    "take more photos that each overlap the next by two thirds, of a surface with visible "
    "texture, and keep the light still while the camera moves"
)


@dataclass(frozen=True)
class PhotoFeatures:
    """The data of one photo kept after feature detection. colours: (n, 3) at the features."""

    key: LensKey
    focal: tuple[float, bool]
    features: Features
    colours: NDArray[np.uint8]


def solve(photos: Sequence[PhotoFile], lens: str, threads: int | None, work: Work) -> Solution:
    """Cameras of all photos that can be placed. Raises PatinaError where there are too few."""
    _check_count(len(photos), "")
    cores = threads or os.cpu_count() or 1
    # a database on a network drive would be slow, or fail
    with scratch_folder() as folder, _full_disk_as_error(folder):
        store = FeatureStore(folder / "features.db", lens)
        try:
            colours, first, unreadable = _extract(photos, store, cores, work)
            _check_count(
                len(colours),
                f"; {len(unreadable)} cannot be read, for example: {_first_reason(unreadable)}",
            )
            indices = sorted(colours)
            work.at("choosing pairs", EXTRACTED_FRACTION)
            selected = choose_pairs(
                [first[n] for n in indices],
                lambda done: work.at(
                    "choosing pairs",
                    EXTRACTED_FRACTION + done * (PAIRED_FRACTION - EXTRACTED_FRACTION),
                ),
            )
            pairs = [(indices[i], indices[j]) for i, j in selected]
            _match(store.path, pairs, cores, work)
            agreeing = store.verified()
        finally:
            store.close()
        models = _map(store.path, len(colours), cores, work)
    by_size = sorted(models, key=lambda model: -model.num_reg_images())
    if not by_size or by_size[0].num_reg_images() < MIN_PHOTOS:
        best = max((points for _, points in agreeing.values()), default=0)
        raise PatinaError(
            f"no group of {MIN_PHOTOS} of the {len(colours)} photos can be connected (the "
            "best photo matches "
            f"{best} points of all others); {OVERLAP_ADVICE}"
        )
    model = by_size[0]
    _colour(model, colours)
    names = {str(number): photo.name for number, photo in enumerate(photos)}
    for image in model.images.values():
        image.name = names[image.name]
    placed = {image.name for image in model.images.values() if image.has_pose}
    unplaced = [
        Unplaced(names[str(n)], *agreeing[str(n)])
        for n in sorted(colours)
        if names[str(n)] not in placed
    ]
    others = tuple(
        tuple(sorted(names[image.name] for image in other.images.values() if image.has_pose))
        for other in by_size[1:]
    )
    return Solution(model, len(photos), tuple(unplaced), tuple(unreadable), others)


@contextmanager
def _full_disk_as_error(folder: Path) -> Iterator[None]:
    """Turn the error of a full disk, which COLMAP's database raises, into a PatinaError."""
    try:
        yield
    except RuntimeError as error:
        if "disk is full" not in str(error):
            raise
        raise PatinaError(
            f"{folder.parent}: the disk is full; free some space, or set TMPDIR to a folder with "
            "more space for temporary files"
        ) from error


def _check_count(count: int, why: str) -> None:
    if count < MIN_PHOTOS:
        raise PatinaError(
            f"found {counted(count, 'usable photo')}; expected at least {MIN_PHOTOS}{why}"
        )


def _first_reason(unreadable: Sequence[tuple[str, str]]) -> str:
    return unreadable[0][1] if unreadable else "none"


def _extract(
    photos: Sequence[PhotoFile], store: FeatureStore, cores: int, work: Work
) -> tuple[dict[int, NDArray[np.uint8]], dict[int, NDArray[np.uint8]], list[tuple[str, str]]]:
    """(colours at the features by photo index; descriptors of the largest features by photo index;
    (name, reason) of unreadable photos)."""
    colours: dict[int, NDArray[np.uint8]] = {}
    first: dict[int, NDArray[np.uint8]] = {}
    unreadable: list[tuple[str, str]] = []
    for number, found in enumerate(_all_seen(photos, cores, work)):
        work.at("finding features", EXTRACTED_FRACTION * (number + 1) / len(photos))
        if isinstance(found, str):
            unreadable.append((photos[number].name, found))
            continue
        store.add(number, found.key, found.focal, found.features)
        colours[number] = found.colours
        first[number] = found.features.descriptors[:LARGEST_FEATURES]
    return colours, first, unreadable


def _all_seen(photos: Sequence[PhotoFile], cores: int, work: Work) -> Iterator[PhotoFeatures | str]:
    """In the order of the photos: the features, or the reason why the photo cannot be read."""

    def see(photo: PhotoFile) -> PhotoFeatures | str:
        work.check()
        try:
            return extract_features(photo.path)
        except PatinaError as error:
            return str(error)

    pool = ThreadPoolExecutor(min(cores, MAX_PARALLEL_PHOTOS))
    try:
        yield from pool.map(see, photos)
    finally:
        pool.shutdown(cancel_futures=True)


def extract_features(path: Path) -> PhotoFeatures:
    """Features of a photo file. Raises InputError."""
    picture, exif = read_picture(path), read_exif(path)
    size = (picture.shape[1], picture.shape[0])
    features = Detector(pooled=True)(grey_of(picture))
    columns, rows = np.clip(features.pixels.astype(np.intp), 0, np.array(size) - 1).T
    key = LensKey.of(size, exif)
    return PhotoFeatures(key, first_focal(size, exif), features, picture[rows, columns])


def _match(database: Path, pairs: Sequence[tuple[int, int]], cores: int, work: Work) -> None:
    """Match pairs of photos; each pair's two-view geometry is verified (Schönberger & Frahm
    2016)."""
    matching = pycolmap.FeatureMatchingOptions()
    matching.use_gpu, matching.num_threads = False, cores
    checking = pycolmap.TwoViewGeometryOptions()
    checking.ransac.random_seed = 0
    pairing = pycolmap.ImportedPairingOptions()
    listed = database.with_name("pairs.txt")
    pairing.match_list_path = str(listed)
    for begin in range(0, len(pairs), PAIRS_PER_BATCH):
        work.at(
            "matching", PAIRED_FRACTION + (MATCHED_FRACTION - PAIRED_FRACTION) * begin / len(pairs)
        )
        some = pairs[begin : begin + PAIRS_PER_BATCH]
        listed.write_text("".join(f"{i} {j}\n" for i, j in some), "ascii")
        pycolmap.match_image_pairs(
            database,
            matching_options=matching,
            pairing_options=pairing,
            verification_options=checking,
            device=pycolmap.Device.cpu,
            cancellation_token=work.token,
        )


def _map(database: Path, count: int, cores: int, work: Work) -> list[pycolmap.Reconstruction]:
    options = pycolmap.IncrementalPipelineOptions()
    options.num_threads = cores
    options.random_seed = 0
    options.min_model_size = MIN_PHOTOS
    options.extract_colors = False  # it would search the photos by their names in the database
    out, empty = database.with_name("models"), database.with_name("nothing")
    out.mkdir()
    empty.mkdir()
    work.at("placing cameras", MATCHED_FRACTION)
    placed = 0

    def count_image() -> None:
        nonlocal placed
        placed += 1
        work.report(
            "placing cameras", MATCHED_FRACTION + (1 - MATCHED_FRACTION) * min(1.0, placed / count)
        )

    found = pycolmap.incremental_mapping(
        database,
        empty,
        out,
        options,
        initial_image_pair_callback=count_image,
        next_image_callback=count_image,
        cancellation_token=work.token,
    )
    work.check()
    return list(found.values())


def _colour(model: pycolmap.Reconstruction, colours: dict[int, NDArray[np.uint8]]) -> None:
    """Set each point's colour to the mean over the photos that observe it."""
    for point in model.points3D.values():
        seen = [
            colours[int(model.images[e.image_id].name)][e.point2D_idx] for e in point.track.elements
        ]
        point.color = np.round(np.mean(seen, axis=0)).astype(np.uint8)
