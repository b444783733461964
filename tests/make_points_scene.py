"""An artificial scene of points and cameras, and the exact pixels of its points.

Camera frame: x right, y down, z forward. Computed with Python floats, without numpy or Patina.
"""

from __future__ import annotations

import math
import random
from collections.abc import Callable
from dataclasses import dataclass, field

Vector = tuple[float, ...]
Matrix = tuple[Vector, ...]
Distort = Callable[[float, float, float], Vector]  # a point in the camera's frame → (x', y')

WIDTH, HEIGHT = 640, 480
FOCAL = 700.0


@dataclass(frozen=True)
class View:
    """One camera. rotation: world → camera; centre: its position."""

    name: str
    rotation: Matrix
    centre: Vector


@dataclass(frozen=True)
class Scene:
    """8 cameras around 1,000 points."""

    views: tuple[View, ...]
    points: tuple[Vector, ...]
    colours: tuple[tuple[int, int, int], ...] = field(default=())


def make_scene(count: int = 1000, seed: int = 7) -> Scene:
    """Return points in a ball of radius 1.2, and cameras at a distance of 4 that face it."""
    dice = random.Random(seed)
    points = []
    while len(points) < count:
        point = tuple(dice.uniform(-1.2, 1.2) for _ in range(3))
        if math.hypot(*point) < 1.2:
            points.append(point)
    colours = tuple(tuple(dice.randrange(256) for _ in range(3)) for _ in points)
    views = []
    for i in range(8):
        around, up = 2 * math.pi * i / 8, 0.6 * math.sin(1.7 * i)
        centre = (
            4 * math.cos(up) * math.cos(around), 4 * math.cos(up) * math.sin(around),
            4 * math.sin(up) + 0.1,
        )  # fmt: skip
        views.append(View(f"IMG_{i:04d}.png", looking(centre, (0.0, 0.0, 0.05), 0.1 * i), centre))
    return Scene(tuple(views), tuple(points), colours)  # type: ignore[arg-type]


def looking(centre: Vector, at: Vector, roll: float) -> Matrix:
    """Return the rotation; rows: the camera's right, down and forward in the world."""
    forward = unit(tuple(a - c for a, c in zip(at, centre, strict=True)))
    right = unit(cross(forward, (0.0, 0.0, 1.0)))
    down = cross(forward, right)
    c, s = math.cos(roll), math.sin(roll)
    return (
        tuple(c * r + s * d for r, d in zip(right, down, strict=True)),
        tuple(-s * r + c * d for r, d in zip(right, down, strict=True)),
        forward,
    )


def unit(v: Vector) -> Vector:
    length = math.hypot(*v)
    return tuple(x / length for x in v)


def cross(a: Vector, b: Vector) -> Vector:
    return (a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0])


def dot(a: Vector, b: Vector) -> float:
    return sum(x * y for x, y in zip(a, b, strict=True))


def in_camera(view: View, point: Vector) -> Vector:
    """Return a point in the camera frame."""
    offset = tuple(p - c for p, c in zip(point, view.centre, strict=True))
    return tuple(dot(row, offset) for row in view.rotation)


def translation(view: View) -> Vector:
    """Return t of x_cam = R x + t."""
    return tuple(-dot(row, view.centre) for row in view.rotation)


def pixels(
    scene: Scene, distort: Distort, fx: float, fy: float, cx: float, cy: float
) -> dict[str, list[Vector]]:
    """Return the pixels of all points in each view."""
    found: dict[str, list[Vector]] = {}
    for view in scene.views:
        rows = []
        for point in scene.points:
            x, y = distort(*in_camera(view, point))
            rows.append((fx * x + cx, fy * y + cy))
        found[view.name] = rows
    return found


def quaternion(m: Matrix) -> Vector:
    """Return the quaternion w, x, y, z of a rotation (Shepperd's method)."""
    trace = m[0][0] + m[1][1] + m[2][2]
    four = (trace, m[0][0], m[1][1], m[2][2])
    best = four.index(max(four))
    q = [0.0, 0.0, 0.0, 0.0]
    q[best] = 1 + (trace if best == 0 else 2 * four[best] - trace)
    for i, j, k in ((1, 2, 3), (2, 3, 1), (3, 1, 2)):
        away, sum_ = m[k - 1][j - 1] - m[j - 1][k - 1], m[k - 1][j - 1] + m[j - 1][k - 1]
        if best == 0:
            q[i] = away
        elif best == i:
            q[0] = away
        else:
            other = j if best == k else k
            q[other] = sum_
    length = math.hypot(*q)
    return tuple(v / length for v in q)


def axis_angle(m: Matrix) -> Vector:
    """Return axis times angle of a rotation, from its quaternion."""
    w, x, y, z = quaternion(m)
    side = math.hypot(x, y, z)
    angle = 2 * math.atan2(side, w)
    return tuple(angle * v / side for v in (x, y, z))


# lenses


def brown(k: Vector = (), p: Vector = (0.0, 0.0)) -> Distort:
    """Brown's distortion, with p1 and p2 in OpenCV's order."""

    def distort(x: float, y: float, z: float) -> Vector:
        x, y = x / z, y / z
        r2 = x * x + y * y
        radial = 1 + sum(value * r2 ** (i + 1) for i, value in enumerate(k))
        return (
            x * radial + 2 * p[0] * x * y + p[1] * (r2 + 2 * x * x),
            y * radial + 2 * p[1] * x * y + p[0] * (r2 + 2 * y * y),
        )

    return distort


def fisheye(k: Vector = (), p: Vector = (0.0, 0.0)) -> Distort:
    """Fisheye: the angle to the axis instead of its tangent, then Brown's distortion."""

    def distort(x: float, y: float, z: float) -> Vector:
        side = math.hypot(x, y)
        theta = math.atan2(side, z)
        return brown(k, p)(theta * x / side, theta * y / side, 1.0)

    return distort


def field_of_view(omega: float) -> Distort:
    """The one-parameter fisheye model of Devernay and Faugeras."""

    def distort(x: float, y: float, z: float) -> Vector:
        r = math.hypot(x, y) / z
        bent = math.atan(2 * r * math.tan(omega / 2)) / omega
        return x / z * bent / r, y / z * bent / r

    return distort


def straightened_by(r: float) -> Distort:
    """The inverse of m (1 + r m²), by bisection."""

    def distort(x: float, y: float, z: float) -> Vector:
        straight = math.hypot(x, y) / z
        low, high = 0.0, 2 * straight
        for _ in range(80):
            middle = (low + high) / 2
            if middle * (1 + r * middle * middle) < straight:
                low = middle
            else:
                high = middle
        return x / z * low / straight, y / z * low / straight

    return distort


def panorama(x: float, y: float, z: float) -> Vector:
    """Longitude and latitude, divided by 2π."""
    turn = 2 * math.pi
    return math.atan2(x, z) / turn, math.atan2(y, math.hypot(x, z)) / turn
