"""Take the samples of all photos, one band of rows at a time.

Each band passes the samples of each material to that material's sinks and is then freed. Memory
depends on the size of one photo, not on the number of photos. Several threads may process bands;
the results are passed on in order, so they do not depend on the number of threads.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Generator, Mapping, Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from ..capture import Capture
from ..concurrency.ordered_map import ordered_map
from ..concurrency.thread_pool import thread_count, thread_pool
from ..geometry import PixelRays, RayScene, Window, bands, view_window
from ..inputs import capture_data
from ..inputs.lights import Lights
from ..inputs.material_pixels import material_pixels
from ..inputs.photos import LitPhoto, LitPhotos
from ..light import Light
from ..samples import SampleReservoir, SampleSink, SampleTable
from ..samples.clipped import White, clipped_rows
from ..samples.face_votes import FaceVotes
from ..samples.reservoir import ALL
from ..samples.take import (
    halo,
    inner_pixels,
    light_surface,
    reached_rows,
    rows_below,
    sample_rows,
    trusted_pixels,
)
from ..scan import Scan

MAX_CLIPPED_SHARE = 1e-3  # of a photo's lit pixels; more gives a note
MAX_CLIPPED_SAMPLES = 100_000  # of one material: each only says how bright it is at least


@dataclass
class PhotoSamples:
    """The samples of all photos.

    kept: a uniform random subset of each material's samples. clipped: the same of its clipped
    samples (clipped.clipped_rows). counts: {material: (photos,) number of samples}. marked:
    {material: number of surface pixels that its masks mark}. votes: material votes of the faces,
    empty where there is one material. notes: {sentence: number of photos it applies to}. seen, lit:
    (photos,) pixels that see the surface, and those of them in the light.
    """

    kept: dict[str, SampleReservoir]
    clipped: dict[str, SampleReservoir]
    counts: dict[str, NDArray[np.int64]]
    marked: dict[str, int]
    votes: FaceVotes
    seen: NDArray[np.int64]
    lit: NDArray[np.int64]
    notes: Counter[str] = field(default_factory=Counter)

    def tables(self, names: Sequence[str]) -> tuple[list[SampleTable], list[SampleTable]]:
        """(the samples of each named material, its clipped samples, thinned as these are). They are
        taken out of the reservoirs, to free memory."""
        measured, clipped = [], []
        for name in names:
            kept = self.kept.pop(name)
            measured.append(kept.table())
            clipped.append(self.clipped.pop(name).table(like=kept))
        return measured, clipped


@dataclass(frozen=True)
class _Shot:
    """One photo and everything that its bands need. white: where the photo is clipped."""

    capture: Capture
    scan: Scan
    rays: RayScene
    light: Light
    place: int
    lines: PixelRays
    photo: LitPhoto
    white: White
    masks: Mapping[str, NDArray[np.bool_]]


@dataclass(frozen=True)
class _Band:
    """The result of one band. tables, clipped_tables, counts, faces: one entry per material;
    counts: of samples, including those that the table leaves out; faces: those of the pixels that
    the material's masks mark."""

    tables: list[SampleTable]
    clipped_tables: list[SampleTable]
    counts: list[int]
    faces: list[NDArray[np.int32]]
    seen: int
    lit: int
    trusted: int
    clipped: int


def take_samples(
    capture: Capture,
    scan: Scan,
    rays: RayScene,
    photos: LitPhotos,
    lights: Lights,
    sinks: Mapping[str, Sequence[SampleSink]] | None = None,
    threads: int | None = None,
) -> Generator[float, None, PhotoSamples]:
    """Take the samples of all photos; yields the fraction done.

    sinks: {material: sinks that get its samples in addition to the reservoir}; they are called
    from this thread only. threads: None for one per core. Raises InputError.
    """
    count, names = len(capture.photos), [m.name for m in capture.materials]
    taken = PhotoSamples(
        kept={name: SampleReservoir(count) for name in names},
        clipped={name: SampleReservoir(count, size=MAX_CLIPPED_SAMPLES) for name in names},
        counts={name: np.zeros(count, np.int64) for name in names},
        marked=dict.fromkeys(names, 0),
        votes=FaceVotes.empty(len(scan.mesh.faces), len(names)),
        seen=np.zeros(count, np.int64),
        lit=np.zeros(count, np.int64),
    )
    others = {name: (sinks or {}).get(name, ()) for name in names}
    workers = thread_count(threads)

    def open_shot(place: int) -> _Shot:
        camera = capture_data.camera_of(capture, scan, place)
        masks = capture_data.photo_masks(capture, place)
        photo = photos.read_with_noise(place)
        light = lights.of(capture, place)
        white = White.of(photo.radiance, photo.usable, photo.mixed)
        return _Shot(capture, scan, rays, light, place, PixelRays.of(camera), photo, white, masks)

    with thread_pool(workers) as pool:
        shots = ordered_map(pool, open_shot, range(count), ahead=1)
        for place in range(count):
            yield place / count
            yield from _take_photo(next(shots), taken, others, pool, workers)
    return taken


def _take_photo(
    shot: _Shot,
    taken: PhotoSamples,
    others: Mapping[str, Sequence[SampleSink]],
    pool: ThreadPoolExecutor | None,
    workers: int,
) -> Generator[float, None, None]:
    """Sample one photo and add the result to ``taken``; yields the fraction of all photos done.
    others: {material: sinks in addition to its reservoir}, which get all samples."""
    capture, place = shot.capture, shot.place
    camera, count = shot.lines.camera, len(capture.photos)
    trusted = clipped = 0
    faces: dict[str, list[NDArray[np.int32]]] = {m.name: [] for m in capture.materials}
    columns = shot.rays.cover.columns(camera)
    cut = list(bands(camera, halo(capture.fit.margins), columns))
    limits = [None if others[name] else kept for name, kept in taken.kept.items()]
    results = ordered_map(pool, lambda window: _band(shot, window, limits), cut, ahead=workers)
    for window, band in zip(cut, results, strict=True):
        taken.seen[place] += band.seen
        taken.lit[place] += band.lit
        trusted += band.trusted
        clipped += band.clipped
        for name, table, clipped_table, number, shown in zip(
            taken.kept, band.tables, band.clipped_tables, band.counts, band.faces, strict=True
        ):
            taken.clipped[name].add(place, clipped_table)
            taken.counts[name][place] += number
            taken.marked[name] += len(shown)
            if len(faces) > 1:  # with one material, every face is of that material
                faces[name].append(shown)
            if len(table):
                taken.kept[name].add(place, table, number)
                for sink in others[name]:
                    sink.add(place, table)
        yield (place + window.last / camera.height) / count
    for index, shown_by_band in enumerate(faces.values()):
        if shown_by_band:
            taken.votes.add(index, np.concatenate(shown_by_band))
    if clipped > MAX_CLIPPED_SHARE * trusted:
        taken.notes[
            "lit pixels are clipped: they only say how bright highlights are at least. Use a "
            "shorter exposure or a bracket."
        ] += 1
    taken.notes.update(shot.photo.notes)


def _band(shot: _Shot, window: Window, limits: Sequence[SampleReservoir | None]) -> _Band:
    """The samples of one band. limits: for each material, the reservoir that alone decides which
    samples are kept, or None where all are needed."""
    capture, margins = shot.capture, shot.capture.fit.margins
    view = view_window(shot.rays, shot.lines, window)
    wanted = np.zeros(len(view.pixel), bool)
    wanted[view.wanted] = True
    lighting = light_surface(shot.rays, view, shot.light, shot.lines.camera)
    where, in_shadow = material_pixels(capture, shot.scan, view, shot.masks)
    trusted = trusted_pixels(view, lighting, margins) & ~in_shadow & wanted
    usable = shot.photo.usable.ravel().take(view.pixel)
    keep = trusted & usable
    photo = shot.photo
    tables, clipped_tables, counts, faces = [], [], [], []
    for material, reservoir in zip(capture.materials, limits, strict=True):
        pixels = where[material.name]
        inner = inner_pixels(view, pixels, margins)
        rows = reached_rows(lighting, keep & inner)
        counts.append(len(rows))
        lost = reached_rows(lighting, trusted & ~usable & inner)
        bounds = clipped_rows(
            view, lighting, photo.radiance, lost, shot.place, shot.white, photo.noise
        )
        clipped_tables.append(bounds)
        limit = ALL if reservoir is None else reservoir.limit(shot.place)
        rows = rows_below(limit, view, lighting, photo.radiance, rows, shot.place)
        tables.append(sample_rows(view, lighting, photo.radiance, rows, shot.place, photo.noise))
        faces.append(view.face[pixels & wanted])
    return _Band(
        tables=tables,
        clipped_tables=clipped_tables,
        counts=counts,
        faces=faces,
        seen=int(wanted.sum()),
        lit=int((wanted & ~lighting.shadowed).sum()),
        trusted=int(trusted.sum()),
        clipped=int((trusted & ~usable).sum()),
    )
