"""The demo capture's object: a lidded jar with a bird on its lid, as a signed distance function.

Everything is in the object's own frame: z up, the foot stands on z = 0, total height about 1.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from itertools import pairwise

import numpy as np
from numpy.typing import NDArray
from scipy.interpolate import PchipInterpolator
from scipy.ndimage import gaussian_filter, map_coordinates, spline_filter
from scipy.spatial import cKDTree

Array = NDArray[np.float64]
Field = Callable[[Array], Array]

LOW, HIGH = np.array([-0.50, -0.42, -0.03]), np.array([0.50, 0.42, 1.03])
"""Bounding box of the object."""

PROFILE = (
    (0.000, 0.208), (0.036, 0.212), (0.046, 0.206), (0.058, 0.190), (0.075, 0.187),
    (0.120, 0.199), (0.190, 0.232), (0.260, 0.272), (0.330, 0.312), (0.400, 0.343),
    (0.460, 0.354), (0.515, 0.341), (0.565, 0.303), (0.605, 0.253), (0.632, 0.222),
    (0.655, 0.212),
)  # fmt: skip
"""(height, radius) of foot, belly and shoulder, joined by a monotone spline."""

LID = (
    (0.690, 0.228), (0.705, 0.222), (0.745, 0.192), (0.785, 0.135), (0.806, 0.072),
    (0.820, 0.050), (0.834, 0.052), (0.846, 0.040),
)  # fmt: skip
"""The same for the lid above its rim."""

RUNS = (
    (0.35, 0.052, 0.15), (1.28, 0.030, 0.11), (2.15, 0.060, 0.17), (2.75, 0.026, 0.10),
    (3.70, 0.046, 0.13), (4.45, 0.064, 0.16), (5.05, 0.028, 0.10), (5.75, 0.040, 0.14),
)  # fmt: skip
"""Runs of glaze over the clay: azimuth (radians), length, width."""


@dataclass(frozen=True)
class Surface:
    """A triangle mesh on the object: points (n, 3), triangles (m, 3), unit normals (n, 3)."""

    points: Array
    triangles: NDArray[np.int64]
    normals: Array


def smoothstep(low: float, high: float, x: Array) -> Array:
    """Return 0 below `low`, 1 above `high`, a cubic between."""
    t = np.clip((x - low) / (high - low), 0.0, 1.0)
    return t * t * (3.0 - 2.0 * t)


def blend(a: Array, b: Array, width: float) -> Array:
    """Return the union of two distance fields with a fillet (Quilez's polynomial minimum)."""
    h = np.maximum(width - np.abs(a - b), 0.0) / width
    return np.minimum(a, b) - h * h * width * 0.25


def ellipsoid(p: Array, centre: tuple, radii: tuple, pitch: float = 0.0) -> Array:
    """Return the approximate distance to an ellipsoid, rotated by `pitch` degrees (+x upwards)."""
    c, s = np.cos(np.radians(pitch)), np.sin(np.radians(pitch))
    q = (p - np.array(centre)) @ np.array([[c, 0.0, -s], [0.0, 1.0, 0.0], [s, 0.0, c]])
    r = np.array(radii)
    k0 = np.linalg.norm(q / r, axis=-1)
    k1 = np.linalg.norm(q / r**2, axis=-1)
    return k0 * (k0 - 1.0) / np.maximum(k1, 1e-9)


def ring(p: Array, centre: tuple, radius: float, thickness: float, lean: float) -> Array:
    """Return the distance to a ring in the x–z plane, leaning outwards by `lean` degrees."""
    c, s = np.cos(np.radians(lean)), np.sin(np.radians(lean))
    q = p - np.array(centre)
    x, z = c * q[..., 0] + s * q[..., 2], -s * q[..., 0] + c * q[..., 2]
    in_plane = np.hypot(x * 1.12, z * 0.90) - radius
    return np.hypot(in_plane, q[..., 1] * 0.86) - thickness


def _densely(line: Array, step: float) -> Array:
    """Return points every `step` or less along an (r, z) line, closed towards the axis."""
    line = np.concatenate([[[0.0, line[0, 1]]], line, [[0.0, line[-1, 1]]]])
    parts = [
        a + (b - a) * np.linspace(0, 1, 2 + int(np.linalg.norm(b - a) / step))[:-1, None]
        for a, b in pairwise(line)
    ]
    return np.concatenate(parts)


class Turned:
    """The solid of revolution: a signed distance on an (r, z) grid, with rounded creases."""

    step = 0.0015

    def __init__(self, rounding: float = 0.0035) -> None:
        z = np.arange(-0.08, 0.95, self.step)
        r = np.arange(0.0, 0.56, self.step)
        radius = np.full_like(z, -1.0)
        body = (z >= 0.0) & (z <= 0.668)
        radius[body] = PchipInterpolator(*zip(*PROFILE, strict=True), extrapolate=True)(z[body])
        lid = (z >= 0.690) & (z <= 0.846)
        radius[lid] = PchipInterpolator(*zip(*LID, strict=True))(z[lid])
        radius[(z > 0.668) & (z < 0.690)] = 0.234  # the lid's rim
        radius[np.abs(z - 0.662) < 0.006] = 0.204  # the shadow line under it
        for height in (0.578, 0.760):  # turned beads on the shoulder and on the lid
            bead = 0.011**2 - (z - height) ** 2
            radius = np.where(bead > 0, radius + 0.6 * np.sqrt(np.maximum(bead, 0)), radius)
        outline = _densely(np.stack([radius, z], -1)[radius >= 0], self.step / 10)
        at = np.stack(np.meshgrid(r, z, indexing="ij"), -1)
        distance = cKDTree(outline).query(at)[0] * np.where(r[:, None] <= radius, -1.0, 1.0)
        mirrored = np.concatenate(
            [distance[:0:-1], distance]
        )  # so that the axis is not a border of the grid
        rounded = gaussian_filter(mirrored, rounding / self.step)[len(r) - 1 :]
        self.spline = spline_filter(rounded, mode="mirror")
        self.start = z[0]

    def __call__(self, r: Array, z: Array) -> Array:
        where = np.stack([np.abs(r) / self.step, (z - self.start) / self.step])
        return map_coordinates(self.spline, where, mode="mirror", prefilter=False)


def glaze_depth(p: Array) -> Array:
    """Return the height of a point above the lower edge of the glaze; bare clay below 0.

    The edge waves and has runs of glaze in irregular places, as on a dipped pot.
    """
    phi = np.arctan2(p[..., 1], p[..., 0])
    edge = 0.222 + 0.008 * np.cos(2 * phi + 0.7) + 0.006 * np.cos(5 * phi + 2.1)
    for where, length, width in RUNS:
        away = (phi - where + np.pi) % (2 * np.pi) - np.pi
        edge = edge - length * np.exp(-((np.abs(away) / width) ** 2.6))
    return p[..., 2] - edge


def make_field() -> Field:
    """Return the signed distance function of the object for points (..., 3).

    The distance is approximate away from the surface.
    """
    turned = Turned()

    def field(p: Array) -> Array:
        x, y, z = p[..., 0], p[..., 1], p[..., 2]
        phi, r = np.arctan2(y, x), np.hypot(x, y)
        # Fourteen soft gadroons, twisted around the belly and fading towards foot and shoulder.
        turn = np.sin(7.0 * (phi + 1.1 * (z - 0.3)))
        lobes = 0.024 * (0.45 - np.sqrt(turn**2 + 0.03) * 0.9 + 0.25)
        window = smoothstep(0.22, 0.36, z) * (1.0 - smoothstep(0.47, 0.575, z))
        jar = turned(r + lobes * -window, z)
        for side in (-1.0, 1.0):
            handle = ring(p * [side, 1, 1], (0.350, 0.0, 0.545), 0.082, 0.0225, -28.0)
            jar = blend(jar, handle, 0.030)
        bird = ellipsoid(p, (-0.004, 0, 0.893), (0.088, 0.054, 0.053), 20)
        bird = blend(bird, ellipsoid(p, (0.062, 0, 0.952), (0.043, 0.038, 0.038)), 0.030)
        bird = blend(bird, ellipsoid(p, (0.112, 0, 0.948), (0.026, 0.0125, 0.0115), -12), 0.012)
        bird = blend(bird, ellipsoid(p, (-0.110, 0, 0.868), (0.072, 0.034, 0.014), 14), 0.030)
        for side in (-1.0, 1.0):
            wing = ellipsoid(p, (-0.028, side * 0.046, 0.896), (0.064, 0.015, 0.031), 16)
            bird = blend(bird, wing, 0.010)
        jar = blend(jar, bird, 0.022)
        depth = glaze_depth(p)
        coat = (
            0.0065 * smoothstep(-0.004, 0.016, depth) * (1 + 0.4 * np.exp(-((depth / 0.03) ** 2)))
        )
        return jar - coat

    return field


def gradient(field: Field, p: Array, step: float = 5e-4) -> Array:
    """Return the gradient (n, 3) of the field by central differences."""
    offsets = np.eye(3) * step
    return np.stack([field(p + o) - field(p - o) for o in offsets], axis=-1) / (2 * step)


def mesh_of(field: Field, cell: float) -> Surface:
    """Return the zero surface: surface nets on a grid, then Newton steps onto the surface."""
    axes = [np.arange(low, high + cell, cell) for low, high in zip(LOW, HIGH, strict=True)]
    shape = tuple(len(axis) for axis in axes)
    values = np.empty(shape)
    for i, x in enumerate(axes[0]):
        values[i] = field(np.stack(np.meshgrid([x], axes[1], axes[2], indexing="ij"), -1)[0])
    inside = values < 0
    number = np.full([n - 1 for n in shape], -1)
    corners = [inside[a : a - 1 or None, b : b - 1 or None, c : c - 1 or None]
               for a in (0, 1) for b in (0, 1) for c in (0, 1)]  # fmt: skip
    count = sum(corner.astype(np.int8) for corner in corners)
    cut = (count > 0) & (count < 8)
    number[cut] = np.arange(cut.sum())
    points = np.stack([axes[d][i] for d, i in enumerate(np.nonzero(cut))], -1) + cell / 2

    quads = []
    for d in range(3):  # one quad around every grid edge that the surface crosses
        one, two = (d + 1) % 3, (d + 2) % 3
        here, there = np.moveaxis(inside, d, 0)[:-1], np.moveaxis(inside, d, 0)[1:]
        at = np.stack(np.nonzero(here != there), -1)
        edge = np.empty_like(at)
        edge[:, d], edge[:, sorted((one, two))[0]], edge[:, sorted((one, two))[1]] = at.T
        around = []
        for a, b in ((0, 0), (1, 0), (1, 1), (0, 1)):
            cellwise = edge.copy()
            cellwise[:, one] -= a
            cellwise[:, two] -= b
            around.append(number[tuple(cellwise.T)])
        quad = np.stack(around, -1)
        outwards = inside[tuple(edge.T)]
        quad[~outwards] = quad[~outwards, ::-1]
        quads.append(quad)
    quad = np.concatenate(quads)

    for _ in range(12):  # smooth along the surface, then project back onto it
        total, degree = np.zeros_like(points), np.zeros(len(points))
        for a, b in ((0, 1), (1, 2), (2, 3), (3, 0)):
            for i, j in ((quad[:, a], quad[:, b]), (quad[:, b], quad[:, a])):
                for axis in range(3):
                    total[:, axis] += np.bincount(i, points[j, axis], len(points))
                degree += np.bincount(i, minlength=len(points))
        points = points + 0.5 * (total / degree[:, None] - points)
        slope = gradient(field, points)
        length = np.maximum((slope**2).sum(-1), 0.05)
        points = points - np.clip(field(points) / length, -cell / 2, cell / 2)[:, None] * slope
    slope = gradient(field, points)
    normals = slope / np.linalg.norm(slope, axis=-1, keepdims=True)
    first = np.linalg.norm(points[quad[:, 0]] - points[quad[:, 2]], axis=-1)
    second = np.linalg.norm(points[quad[:, 1]] - points[quad[:, 3]], axis=-1)
    turned = np.where((first <= second)[:, None], quad, np.roll(quad, -1, axis=1))
    triangles = np.concatenate([turned[:, [0, 1, 2]], turned[:, [0, 2, 3]]])
    return Surface(points, triangles, normals)


def vertex_normals(points: Array, triangles: Array) -> Array:
    """Return area-weighted unit normals at the points."""
    a, b, c = (points[triangles[:, i]] for i in range(3))
    faces = np.cross(b - a, c - a)
    total = np.zeros_like(points)
    for i in range(3):
        np.add.at(total, triangles[:, i], faces)
    return total / np.linalg.norm(total, axis=-1, keepdims=True)
