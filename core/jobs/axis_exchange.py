"""Recognise a mesh whose axes were exchanged by an export (y up in place of z up): another rotation
by right angles makes its shading agree with the photos."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from itertools import permutations, product

import numpy as np
from numpy.typing import NDArray

from ..capture import Capture
from ..errors import InputError, PatinaError
from ..geometry import RayScene
from ..geometry.lift import facet_lift
from ..inputs import capture_data
from ..inputs.lights import Lights
from ..inputs.photos import LitPhotos
from ..light.incidence import Light
from ..scan import Camera, Scan

Array = NDArray[np.float64]

MAX_PHOTOS = 6  # that are compared
WIDTH = 160  # pixels of a reduced photo
MIN_HITS = 200  # reduced pixels that show the mesh
MIN_CORRELATION = 0.5  # of shading and brightness with the right axes; real objects: 0.6 to 0.95
MIN_GAIN = 0.3  # of the correlation, for axes to be proposed
SYMMETRY = 0.02  # difference of the correlation of rotations that a symmetric object cannot tell
USUAL_EXCHANGES = ("x, -z, y", "x, z, -y")  # y up → z up and z up → y up


def with_axes(
    error: InputError,
    capture: Capture,
    scan: Scan,
    rays: RayScene,
    photos: LitPhotos,
    lights: Lights,
) -> InputError:
    """The error of a capture whose photos do not fit its mesh, with the axes that would fit, if
    there are any."""
    hint = better_axes(capture, scan, rays, photos, lights)
    if not hint:
        return error
    return InputError(f"{error.detail}. {hint}", file=error.file, key=error.key, line=error.line)


def better_axes(
    capture: Capture, scan: Scan, rays: RayScene, photos: LitPhotos, lights: Lights
) -> str:
    """A sentence that proposes other axes of the mesh, "" where none fit the photos far better, or
    the photos cannot be read."""
    places = range(0, len(capture.photos), -(-len(capture.photos) // MAX_PHOTOS))
    try:
        seen = [_Reduced.of(capture, scan, photos, lights, place) for place in places]
    except (PatinaError, OSError):  # the network may have been lost since they were sampled
        return ""
    found = {_axes(rotation): _agreement(rotation, seen, rays) for rotation in _rotations()}
    now, best = found["x, y, z"], max(found.values())
    alike = [axes for axes, value in found.items() if value > best - SYMMETRY]
    shown = next((axes for axes in USUAL_EXCHANGES if axes in alike), alike[0])
    if best < MIN_CORRELATION or best < now + MIN_GAIN:
        return ""
    return (
        f"The mesh would agree with the photos if its axes were exchanged: (x, y, z) → "
        f"({shown}), correlation of shading and brightness {best:.2f} instead of "
        f"{max(now, 0.0):.2f}. Export it again with the axes of the cameras (usually z up, not y "
        "up)."
    )


@dataclass(frozen=True)
class _Reduced:
    """A part of a photo's pixels. start: (3,) or (n, 3), of their rays; along: (n, 3) unit
    directions, both in the frame of the cameras; brightness: (n,)."""

    camera: Camera
    light: Light
    start: Array
    along: Array
    brightness: Array

    @classmethod
    def of(
        cls, capture: Capture, scan: Scan, photos: LitPhotos, lights: Lights, place: int
    ) -> _Reduced:
        """Read a photo, and average blocks of its pixels."""
        camera = capture_data.camera_of(capture, scan, place)
        step = max(1, camera.width // WIDTH)
        level = photos.read(place).radiance.mean(axis=2, dtype=np.float64)
        height, width = (n // step for n in level.shape)
        blocks = level[: height * step, : width * step].reshape(height, step, width, step)
        row, column = np.mgrid[:height, :width]
        pixels = (np.stack([column.ravel(), row.ravel()], axis=1) + 0.5) * step
        along = camera.rays(pixels)
        valid = np.isfinite(along).all(axis=1)
        start = camera.ray_starts(pixels)
        return cls(
            camera,
            lights.of(capture, place),
            start if start.ndim == 1 else start[valid],
            along[valid],
            blocks.mean(axis=(1, 3)).ravel()[valid],
        )


def _agreement(rotation: Array, seen: list[_Reduced], rays: RayScene) -> float:
    """Correlation of the photos with the shading of a white mesh that is rotated; -1 where they
    show too little of it."""
    lift = facet_lift(rays.mesh)
    shading, brightness = [], []
    for one in seen:
        start, along = one.start @ rotation, one.along @ rotation  # in the frame of the mesh
        if start.ndim == 2:
            start = rays.just_before(start, along)
        hits = rays.first_hits(start, along)
        hit = hits.face >= 0
        found = hits.select(hit)
        point, normal = rays.points(found), rays.normals(found)
        light = one.light.incidence(point @ rotation.T, one.camera)
        towards = light.towards @ rotation
        cosine = np.maximum(np.sum(normal * towards, axis=1), 0.0)
        cosine[rays.occluded(point, towards, light.distance, lift * normal)] = 0.0
        shading.append(cosine * light.irradiance.mean(axis=1))
        brightness.append(one.brightness[hit])
    if sum(map(len, shading)) < MIN_HITS:
        return -1.0
    pair = np.sqrt(np.maximum([np.concatenate(shading), np.concatenate(brightness)], 0.0))
    if not pair.std(axis=1).all():
        return -1.0
    return float(np.corrcoef(pair)[0, 1])


def _rotations() -> Iterator[Array]:
    """The 24 rotations by right angles."""
    for order in permutations(range(3)):
        for signs in product((1.0, -1.0), repeat=3):
            rotation = np.zeros((3, 3))
            rotation[range(3), order] = signs
            if np.linalg.det(rotation) > 0:
                yield rotation


def _axes(rotation: Array) -> str:
    """The rotated coordinates, such as "x, -z, y"."""
    names = []
    for row in rotation:
        axis = int(np.abs(row).argmax())
        names.append(("-" if row[axis] < 0 else "") + "xyz"[axis])
    return ", ".join(names)
