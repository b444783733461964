"""Fit a sphere to its outline in a photo: the rays form a right circular cone for every lens.

The image of a sphere is an ellipse (a conic) under perspective, and a more complex curve with lens
distortion. The rays through the outline are simple in both cases: they are all tangent to the
sphere and have the same angle to the ray through its centre. This cone is fitted.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from ..angles.vectors import tangents
from ..errors import InputError
from ..scan.camera import Camera

Array = NDArray[np.float64]

MIN_POINTS = 8  # of an outline
MAX_HALF_ANGLE = np.radians(80.0)  # of the cone; no photo of a sphere has a wider one


@dataclass(frozen=True)
class Circle:
    """A circle drawn by the user near a sphere's outline.

    centre: (x, y) pixels, the top left pixel's centre at (0.5, 0.5). radius: pixels.
    """

    centre: tuple[float, float]
    radius: float


@dataclass(frozen=True)
class Sphere:
    """A sphere in the scan frame, as far as one photo determines it.

    Perspective camera: the size is unknown, so radius is 1; origin is the camera's centre, and
    centre (3,) has the distance, in radii, that follows from the outline's angle. Orthographic
    camera: radius and centre are in scan units, and the depth of the centre is arbitrary (in front
    of the camera).
    """

    centre: Array
    radius: float
    origin: Array | None  # None: all rays are parallel

    @property
    def half_angle(self) -> float:
        """Angle between the rays to the centre and to the outline, radians; 0 if orthographic."""
        if self.origin is None:
            return 0.0
        return float(np.arcsin(self.radius / np.linalg.norm(self.centre - self.origin)))

    def rays(self, camera: Camera, pixels: Array) -> tuple[Array, Array]:
        """((n, 3) starts, (n, 3) unit directions) of the rays of pixels (n, 2), in the sphere's
        units."""
        directions = camera.rays(pixels)
        if self.origin is None:
            return camera.ray_starts(pixels), directions
        return np.broadcast_to(self.origin, directions.shape), directions

    def relative_radius(self, camera: Camera, pixels: Array) -> Array:
        """(n,) 0 at the centre, 1 on the outline, larger outside."""
        starts, directions = self.rays(camera, pixels)
        if self.origin is None:
            return np.linalg.norm(np.cross(starts - self.centre, directions), axis=1) / self.radius
        axis = (self.centre - self.origin) / np.linalg.norm(self.centre - self.origin)
        return _angle(directions, axis) / self.half_angle

    def outline(self, camera: Camera, azimuths: Array, scale: float | Array = 1.0) -> Array:
        """(n, 2) pixels of the outline at azimuths (n,), radians, or of an outline ``scale`` times
        as wide; NaN where the camera does not see it."""
        around = np.cos(azimuths)[:, None], np.sin(azimuths)[:, None]
        scale = np.broadcast_to(np.asarray(scale, float), azimuths.shape)[:, None]
        if self.origin is None:
            _, across, down = _frame(camera.rays(_middle(camera))[0])
            points = self.centre + self.radius * scale * (around[0] * across + around[1] * down)
            return camera.project(points)
        axis, across, down = _frame(self.centre - self.origin)
        wide = self.half_angle * scale
        turn = around[0] * across + around[1] * down
        return camera.project(camera.pose.centre + np.cos(wide) * axis + np.sin(wide) * turn)

    def moved(self, camera: Camera, shift: tuple[float, float, float]) -> Sphere:
        """The sphere with its outline shifted across, down, and widened; units: its radius."""
        across_by, down_by, wider_by = shift
        if self.origin is None:
            _, across, down = _frame(camera.rays(_middle(camera))[0])
            centre = self.centre + self.radius * (across_by * across + down_by * down)
            return Sphere(centre, self.radius * (1 + wider_by), None)
        axis, across, down = _frame(self.centre - self.origin)
        turned = axis + np.tan(self.half_angle) * (across_by * across + down_by * down)
        return _from_cone(self.origin, turned, self.half_angle * (1 + wider_by))


def fit_sphere(camera: Camera, pixels: Array, weights: Array | None = None) -> Sphere:
    """Fit a sphere to points (n, 2) of its outline, pixels, n ≥ 3, by weighted least squares.

    Perspective: a · d = 1 for the unit rays d, where a/|a| is the cone's axis and 1/|a| the cosine
    of its half-angle. The residual is the angle to the cone times tan(half-angle), the same factor
    for all points, so the linear fit equals the geometric fit. Orthographic: a circle, likewise.
    weights: (n,). Raises InputError where no sphere fits.
    """
    if len(pixels) < 3 or not np.isfinite(pixels).all():
        raise InputError(
            f"the sphere's outline has {len(pixels)} points; expected at least 3 finite points"
        )
    root = np.sqrt(np.ones(len(pixels)) if weights is None else weights)
    directions = camera.rays(pixels)
    if camera.orthographic:
        axis, across, down = _frame(camera.rays(_middle(camera))[0])
        starts = camera.ray_starts(pixels)
        middle = starts.mean(axis=0)
        x, y = (starts - middle) @ across, (starts - middle) @ down
        rows = np.stack([x, y, np.ones_like(x)], axis=1)
        (a, b, c), *_ = np.linalg.lstsq(rows * root[:, None], (x * x + y * y) * root, rcond=None)
        squared = c + (a * a + b * b) / 4
        if not squared > 0:
            raise InputError(
                "the points of the sphere's outline are not on a circle; expected the outline of a "
                "sphere"
            )
        radius = float(np.sqrt(squared))
        centre = middle + a / 2 * across + b / 2 * down
        ahead = 2 * radius - (camera.pose.rotation @ centre + camera.pose.translation)[2]
        return Sphere(centre + ahead * axis, radius, None)
    if not np.isfinite(directions).all():
        raise InputError(
            "the sphere's outline reaches beyond the image area for which the lens distortion is "
            "defined; expected a sphere inside it"
        )
    a, *_ = np.linalg.lstsq(directions * root[:, None], root, rcond=None)
    length = float(np.linalg.norm(a))
    if not length > 1.0:
        raise InputError(
            "the points of the sphere's outline are not on a cone of rays; expected the outline of "
            "a sphere"
        )
    return _from_cone(camera.pose.centre, a, float(np.arccos(1.0 / length)))


def circle_pixels(circle: Circle, count: int = 90) -> Array:
    """(count, 2) points on the circle, pixels. Raises InputError for an invalid circle."""
    x, y = circle.centre
    if not (np.isfinite([x, y, circle.radius]).all() and circle.radius > 0):
        raise InputError(
            f"found center {circle.centre} and radius {circle.radius}; expected finite pixels and "
            "a positive radius",
            key="sphere",
        )
    turn = np.arange(count) / count * 2 * np.pi
    return np.stack([x + circle.radius * np.cos(turn), y + circle.radius * np.sin(turn)], axis=1)


def mask_pixels(mask: NDArray, longest: int = 4000) -> Array:
    """(n, 2) points of a mask's edge, pixels: where a row or column crosses 0.5, interpolated.

    mask: (h, w), white = sphere, hard (bool) or soft (0..1). The border of the image does not
    count as an edge. longest: approximate maximum of n. Raises InputError where the edge has fewer
    than MIN_POINTS points.
    """
    value = np.asarray(mask, float)
    if not np.isfinite(value).all():
        raise InputError(
            "the sphere's mask has NaN or infinite values; expected 0 to 1", key="sphere"
        )
    points = []
    for axis in (0, 1):
        first, second = (value[:-1], value[1:]) if axis == 0 else (value[:, :-1], value[:, 1:])
        row, column = np.nonzero((first > 0.5) != (second > 0.5))
        before, after = first[row, column], second[row, column]
        part = (0.5 - before) / (after - before)
        y = row + 0.5 + (part if axis == 0 else 0.0)
        x = column + 0.5 + (part if axis == 1 else 0.0)
        points.append(np.stack([x, y], axis=1))
    found = np.concatenate(points)
    if len(found) < MIN_POINTS:
        raise InputError(
            f"the edge of the sphere's mask has {len(found)} points; expected a white disc on "
            "black",
            key="sphere",
        )
    return found[:: max(1, len(found) // longest)]


def pixel_radius(sphere: Sphere, camera: Camera) -> float:
    """Mean radius of the outline, pixels; NaN where too little of it is in front of the camera."""
    ring = sphere.outline(camera, np.arange(16) / 16 * 2 * np.pi)
    ring = ring[np.isfinite(ring).all(axis=1)]
    if len(ring) < 8:
        return float("nan")
    return float(np.linalg.norm(ring - ring.mean(axis=0), axis=1).mean())


def _from_cone(origin: Array | None, axis: Array, half_angle: float) -> Sphere:
    if not 0 < half_angle < MAX_HALF_ANGLE:
        raise InputError(
            "the sphere's outline is too wide for a sphere; expected a cone of rays with a "
            "half-angle below 80°"
        )
    towards = axis / np.linalg.norm(axis)
    return Sphere(origin + towards / np.sin(half_angle), 1.0, origin)


def _frame(direction: Array) -> tuple[Array, Array, Array]:
    """(unit direction, and two unit vectors perpendicular to it and to each other)."""
    axis = direction / np.linalg.norm(direction)
    across, along = tangents(axis[None])
    return axis, across[0], along[0]


def _angle(directions: Array, axis: Array) -> Array:
    """(n,) angle, radians; by arctan2, because the cosine of a small angle loses precision."""
    return np.arctan2(np.linalg.norm(np.cross(directions, axis), axis=1), directions @ axis)


def _middle(camera: Camera) -> Array:
    return np.array([[camera.width / 2, camera.height / 2]])
