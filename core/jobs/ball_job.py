"""Measure the light of one lit photo from a chrome or glossy ball in it, as a job."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from typing import Literal

import numpy as np
from numpy.typing import NDArray

from ..capture import Capture
from ..concurrency.job import Job, Step
from ..inputs import capture_data
from ..inputs.photos import LitPhotos
from ..light.sphere import SphereLight, light_from_sphere
from ..light.sphere_outline import Circle, Sphere, circle_pixels
from ..light.sphere_search import search_sphere
from ..scan import Camera

READING, MEASURING = "reading the photo", "measuring the ball"
READ_SHARE = 0.3  # of the job's time
RING_POINTS = 64
FIRST_RADIUS = 0.15  # of the photo's shorter side: an outline to be moved by hand

Array = NDArray[np.float64]


@dataclass(frozen=True)
class FoundBall:
    """light: from the ball, None where the photo shows none. ring: (n, 3) points of its outline, or
    of one to be moved onto it, in the camera's axes (x right, y down, z forward), at z = 1."""

    light: SphereLight | None
    ring: Array


class BallJob(Job):
    """Sets ``result``. Without an outline the ball is searched for."""

    def __init__(
        self,
        capture: Capture,
        place: int,
        outline: Array | None = None,
        surface: Literal["chrome", "glossy"] = "chrome",
    ) -> None:
        """place: index of the photo. outline: (n, 3) points near the outline, in the axes of the
        photo's camera; their distance does not matter for a perspective camera."""
        super().__init__()
        self.capture, self.place = capture, place
        self.outline, self.surface = outline, surface
        self.result: FoundBall | None = None

    def run(self) -> Iterator[Step]:
        """Read the photo, then measure the ball. Raises PatinaError."""
        yield Step(READING, 0.0)
        scan = capture_data.open_scan(self.capture)
        camera = capture_data.camera_of(self.capture, scan, self.place)
        radiance = LitPhotos.open(self.capture).read(self.place).radiance
        radiance = np.nan_to_num(radiance, posinf=float(np.nanmax(radiance, initial=0.0)))
        yield Step(MEASURING, READ_SHARE)
        outline: Circle | None
        if self.outline is not None:
            outline = _circle(camera.project(_in_scan(camera, self.outline)))
        elif search_sphere(radiance, camera) is None:
            size = camera.width, camera.height
            middle = Circle((size[0] / 2, size[1] / 2), FIRST_RADIUS * min(size))
            pixels = circle_pixels(middle, RING_POINTS)
            self.result = FoundBall(None, _in_camera(camera, pixels))
            return
        else:
            outline = None
        found = light_from_sphere(radiance, camera, outline, surface=self.surface)
        self.result = FoundBall(found, _in_camera(camera, _outline(found.sphere, camera)))


def _outline(sphere: Sphere, camera: Camera) -> Array:
    """(n, 2) pixels of the outline."""
    pixels = sphere.outline(camera, np.arange(RING_POINTS) / RING_POINTS * 2 * np.pi)
    return pixels[np.isfinite(pixels).all(axis=1)]


def _circle(pixels: Array) -> Circle:
    """The circle with the mean centre and radius of points (n, 2)."""
    x, y = pixels.mean(axis=0)
    radius = float(np.linalg.norm(pixels - (x, y), axis=1).mean())
    return Circle((float(x), float(y)), radius)


def _in_camera(camera: Camera, pixels: Array) -> Array:
    """(n, 3) points at z = 1 of pixels (n, 2)."""
    rotation, translation = camera.pose.rotation, camera.pose.translation
    directions = camera.rays(pixels) @ rotation.T
    if camera.orthographic:
        starts = camera.ray_starts(pixels) @ rotation.T + translation
        return np.asarray(np.column_stack([starts[:, :2], np.ones(len(starts))]))
    return np.asarray(directions / directions[:, 2:])


def _in_scan(camera: Camera, points: Array) -> Array:
    """(n, 3) scan frame, of points in the camera's axes."""
    return np.asarray((points - camera.pose.translation) @ camera.pose.rotation)
