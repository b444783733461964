"""The up axis of a scan, from its cameras; a large flat side of the mesh supports it.

Nobody holds a camera at a random roll: the horizontal axis of a photo is nearly level. The up axis
is therefore the direction that is perpendicular to the horizontal axes of all photos, on the side
of their mean up direction. Photos in portrait format, whose horizontal axis is the vertical one of
the camera, are recognised.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from .camera import Camera
from .mesh import Mesh

Array = NDArray[np.float64]

LEVEL = np.radians(15.0)  # roll below which a photo agrees with the up axis
MIN_ROLL = np.radians(0.5)  # scale of the robust weights: of a camera on a tripod
MIN_SPREAD = 4.0  # second to smallest eigenvalue: below, all cameras look in one direction
ALONE_ERROR = np.radians(30.0)  # where they do: the cameras may all look down
MIN_AGREEMENT, MAX_ERROR = 0.7, np.radians(10.0)  # of an axis that is used
GROUND_CONE = np.radians(10.0)  # normals of a flat side about the axis
MIN_GROUND = 0.1  # of the area of the mesh
FLATNESS = 0.01  # thickness of a flat side relative to the size of the mesh
SNAP, MAX_SNAP = np.radians(1.0), np.radians(3.0)  # to an axis of the scan's frame
ROUNDS = 5  # of reweighting


@dataclass(frozen=True)
class UpAxis:
    """The up axis of a scan. direction: (3,) unit vector in the scan's frame; standard_error:
    radians; agreement: share of the cameras that are level with it; ground: whether a large flat
    side of the mesh is perpendicular to it."""

    direction: Array
    standard_error: float
    agreement: float
    ground: bool = False

    @property
    def reliable(self) -> bool:
        """Whether the axis is known well enough to set the object upright by it."""
        return self.agreement >= MIN_AGREEMENT and self.standard_error <= MAX_ERROR


def find_up(cameras: Sequence[Camera], mesh: Mesh | None = None) -> UpAxis | None:
    """The up axis of a scan; None without cameras, or where their up directions cancel out."""
    if not cameras:
        return None
    rotations = np.array([camera.pose.rotation for camera in cameras], np.float64)
    found = up_of_rotations(rotations)
    if found is None:
        return None
    ground = None if mesh is None else _ground(mesh, found.direction)
    if ground is not None:
        supported = float(np.arccos(np.clip(ground @ found.direction, -1, 1)))
        if supported <= max(3 * found.standard_error, np.radians(2.0)):
            exact = ground if found.standard_error > np.radians(1.0) else found.direction
            error = min(found.standard_error, max(supported, np.radians(0.5)))
            found = UpAxis(exact, error, found.agreement, True)
    return _snapped(found)


def up_of_rotations(rotations: Array) -> UpAxis | None:
    """The up axis from the rotations (n, 3, 3) world → camera (x right, y down, z forward)."""
    right, up = rotations[:, 0], -rotations[:, 1]
    mean = max((up.sum(axis=0), right.sum(axis=0), -right.sum(axis=0)), key=np.linalg.norm)
    length = float(np.linalg.norm(mean))
    if length < 0.05 * len(rotations):
        return None
    axis = mean / length
    weights = np.ones(len(rotations))
    level, values, vectors = right, np.zeros(3), np.eye(3)
    for _ in range(ROUNDS):
        portrait = np.abs(right @ axis) > np.abs(up @ axis)
        level = np.where(portrait[:, None], up, right)
        values, vectors = np.linalg.eigh((weights[:, None] * level).T @ level)
        roll = np.arcsin(np.clip(level @ axis, -1, 1))
        if values[1] < MIN_SPREAD * max(values[0], MIN_ROLL**2):
            agreement = float(np.mean(np.abs(roll) < LEVEL))
            return UpAxis(axis, float(ALONE_ERROR), agreement)
        smallest = vectors[:, 0]
        axis = smallest if smallest @ mean >= 0 else -smallest
        roll = np.arcsin(np.clip(level @ axis, -1, 1))
        scale = max(float(np.median(np.abs(roll))), MIN_ROLL)
        weights = 1 / (1 + (roll / (2 * scale)) ** 2)
    free = max(len(rotations) - 2, 1)
    variance = max(float((weights * roll**2).sum()) / free, MIN_ROLL**2 / 4)
    error = float(np.sqrt(variance / values[1] + variance / values[2]))
    return UpAxis(axis, error, float(np.mean(np.abs(roll) < LEVEL)))


def rotation_to_z(up: Array) -> Array:
    """(3, 3) the smallest rotation that turns the unit vector ``up`` (3,) to +z."""
    x, y, z = up
    if z < -1 + 1e-9:
        return np.diag([1.0, -1.0, -1.0])  # upside down: about x
    cross = np.array([[0.0, 0.0, -x], [0.0, 0.0, -y], [x, y, 0.0]])
    return np.eye(3) + cross + cross @ cross / (1 + z)


def _ground(mesh: Mesh, up: Array) -> Array | None:
    """(3,) normal of the largest flat side whose normal is near ±up, on the side of ``up``; None if
    there is none."""
    corners = mesh.vertices[mesh.faces]
    cross = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    area = np.linalg.norm(cross, axis=1)
    normals = cross / np.maximum(area, 1e-300)[:, None]
    near = np.abs(normals @ up) > np.cos(GROUND_CONE)
    if area[near].sum() < MIN_GROUND * area.sum():
        return None
    middle = corners[near].mean(axis=1)
    height = middle @ up
    band = FLATNESS * mesh.size
    order = np.argsort(height)
    sums = np.concatenate([[0.0], np.cumsum(area[near][order])])
    ends = np.searchsorted(height[order], height[order] + band, side="right")
    covered = sums[ends] - sums[:-1]
    best = int(covered.argmax())
    if covered[best] < MIN_GROUND * area.sum():
        return None
    flat = order[best : ends[best]]
    own = normals[near][flat] * np.sign(normals[near][flat] @ up)[:, None]
    total = (area[near][flat][:, None] * own).sum(axis=0)
    return np.asarray(total / np.linalg.norm(total))


def _snapped(found: UpAxis) -> UpAxis:
    """The nearest axis of the scan's frame, if it is within the error of the direction."""
    place = int(np.abs(found.direction).argmax())
    axis = np.zeros(3)
    axis[place] = np.sign(found.direction[place])
    off = float(np.arccos(np.clip(axis @ found.direction, -1, 1)))
    if off > min(max(SNAP, 2 * found.standard_error), MAX_SNAP):
        return found
    return UpAxis(axis, found.standard_error, found.agreement, found.ground)
