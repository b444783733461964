"""A camera's pose from pixels and the scan's points they show (perspective-n-point)."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import pycolmap
from numpy.typing import NDArray

from ..scan import Camera, Pose

Array = NDArray[np.float64]
STEEPEST = 5.0  # x/z of pixels used: a fisheye's rim has none that is finite
TRIALS = 20_000
HUBER = 1.345  # of the residuals' σ: 95 % efficient for normal ones (Huber 1981)


@dataclass(frozen=True)
class FoundPose:
    """pose; inliers: (n,) bool; error: median distance of the inliers, pixels; covariance: (6, 6)
    of the rotation about the camera's own axes (radians) and of its centre (scan units)."""

    pose: Pose
    inliers: NDArray[np.bool_]
    error: float
    covariance: Array
    pixel_deviation: float

    @property
    def angle_deviation(self) -> float:
        """Standard deviation of the orientation: the length of the rotation vector, radians."""
        return float(np.sqrt(np.trace(self.covariance[:3, :3])))

    @property
    def place_deviation(self) -> float:
        """Standard deviation of the centre: the length of its error, scan units."""
        return float(np.sqrt(np.trace(self.covariance[3:, 3:])))


def focal_of(camera: Camera) -> float:
    """Pixels per unit of x/z, mean of both axes."""
    lens = camera.lens
    return 0.5 * (lens.focal_length_x + lens.focal_length_y)


def straightened(camera: Camera, pixels: Array) -> Array:
    """(n, 2) pixels of the distortion-free camera of the same focal length with its principal
    point at (0, 0); NaN where the lens sees too steeply for one."""
    flat = np.asarray(camera.lens.cam_from_img(np.ascontiguousarray(pixels)), np.float64)
    flat = flat.reshape(len(pixels), 2)
    with np.errstate(invalid="ignore"):
        wild = ~(np.abs(flat).max(axis=1) < STEEPEST)
    flat[wild] = np.nan
    return flat * focal_of(camera)


def find_pose(camera: Camera, pixels: Array, points: Array, limit: float) -> FoundPose | None:
    """The pose of a camera (its own is ignored) that shows most points (n, 3) within ``limit``
    pixels of pixels (n, 2), which may be wrong for most; None where no pose shows enough.

    LO-RANSAC over the P3P solver, then least squares under a Cauchy loss (pycolmap).
    """
    flat = straightened(camera, pixels)
    usable = np.isfinite(flat).all(axis=1) & np.isfinite(points).all(axis=1)
    if usable.sum() < 6:
        return None
    origin = np.median(points[usable], axis=0)  # georeferenced points are large numbers
    options = pycolmap.AbsolutePoseEstimationOptions()
    options.ransac.max_error = limit
    options.ransac.min_inlier_ratio = 0.01
    options.ransac.max_num_trials = TRIALS
    options.ransac.random_seed = 0
    found = pycolmap.estimate_and_refine_absolute_pose(
        flat[usable], points[usable] - origin, _pinhole(camera), options
    )
    if found is None:
        return None
    rigid = found["cam_from_world"]
    pose = Pose(np.array(rigid.rotation.matrix()), np.array(rigid.translation))
    pose = Pose(pose.rotation, pose.translation - pose.rotation @ origin)
    return judged(camera, pose, flat, points, limit)


def refine_pose(
    camera: Camera, start: Pose, pixels: Array, points: Array, limit: float
) -> FoundPose | None:
    """The pose near ``start`` that fits best what lies within ``limit`` pixels: Gauss-Newton
    under Huber's weights. None where too little does."""
    flat = straightened(camera, pixels)
    pose = start
    focal = focal_of(camera)
    for _ in range(20):
        offset, jacobian, front = _linearised(pose, flat, points, focal)
        length = np.linalg.norm(offset, axis=1)
        with np.errstate(invalid="ignore"):
            near = front & (length < limit)
        if near.sum() < 6:
            return None
        sigma = _deviation(offset[near])
        weight = np.minimum(1.0, HUBER * sigma / np.maximum(length[near], 1e-12))
        rows = (jacobian[near] * np.sqrt(weight)[:, None, None]).reshape(-1, 6)
        right = (offset[near] * np.sqrt(weight)[:, None]).reshape(-1)
        scale = np.maximum(np.linalg.norm(rows, axis=0), 1e-300)
        step = np.linalg.lstsq(rows / scale, right, rcond=None)[0] / scale
        pose = _moved(pose, step)
        if np.abs(step * scale).max() < 1e-6 * np.sqrt(len(rows)):
            break
    return judged(camera, pose, flat, points, limit)


def judged(
    camera: Camera, pose: Pose, flat: Array, points: Array, limit: float
) -> FoundPose | None:
    """A pose with what speaks for it. The covariance is that of least squares with the inliers'
    own scatter; it knows nothing of errors all of them share, such as a bent mesh."""
    offset, jacobian, front = _linearised(pose, flat, points, focal_of(camera))
    length = np.linalg.norm(offset, axis=1)
    with np.errstate(invalid="ignore"):
        inliers: NDArray[np.bool_] = front & (length < limit)
    if inliers.sum() < 6:
        return None
    rows = jacobian[inliers].reshape(-1, 6)
    scale = np.maximum(np.linalg.norm(rows, axis=0), 1e-300)
    normal = (rows / scale).T @ (rows / scale)
    unit = np.linalg.pinv(normal, hermitian=True) / np.outer(scale, scale)
    covariance = _deviation(offset[inliers]) ** 2 * unit
    shifts = np.einsum("nij,jk,nik->n", jacobian[inliers], covariance, jacobian[inliers])
    return FoundPose(
        pose,
        inliers,
        float(np.median(length[inliers])),
        covariance,
        float(np.sqrt(shifts.mean())),
    )


def _deviation(offset: Array) -> float:
    """σ of one coordinate, from the median distance (Rayleigh's is 1.1774 σ)."""
    return max(float(np.median(np.linalg.norm(offset, axis=1))) / 1.1774, 1e-6)


def _linearised(
    pose: Pose, flat: Array, points: Array, focal: float
) -> tuple[Array, Array, NDArray[np.bool_]]:
    """(seen − shown (n, 2), derivative of shown (n, 2, 6), in front and known (n,))."""
    there = (points - pose.centre) @ pose.rotation.T
    with np.errstate(invalid="ignore", divide="ignore"):
        front = there[:, 2] > 0
        z = np.where(front, there[:, 2], np.nan)
        shown = focal * there[:, :2] / z[:, None]
    front &= np.isfinite(flat).all(axis=1) & np.isfinite(shown).all(axis=1)
    zero = np.zeros(len(points))
    by_place = np.stack(
        [
            np.stack([focal / z, zero, -shown[:, 0] / z], axis=1),
            np.stack([zero, focal / z, -shown[:, 1] / z], axis=1),
        ],
        axis=1,
    )  # (n, 2, 3) by the point in the camera's frame
    x, y, w = there.T
    turn = np.stack(
        [
            np.stack([zero, w, -y], axis=1),
            np.stack([-w, zero, x], axis=1),
            np.stack([y, -x, zero], axis=1),
        ],
        axis=1,
    )  # (n, 3, 3): −[x]×, by a rotation vector
    jacobian = np.concatenate([by_place @ turn, -by_place @ pose.rotation], axis=2)
    return flat - shown, jacobian, front


def _moved(pose: Pose, step: Array) -> Pose:
    angle = float(np.linalg.norm(step[:3]))
    axis = step[:3] / angle if angle > 0 else np.array([1.0, 0.0, 0.0])
    cross = np.array([[0, -axis[2], axis[1]], [axis[2], 0, -axis[0]], [-axis[1], axis[0], 0]])
    turn = np.eye(3) + np.sin(angle) * cross + (1 - np.cos(angle)) * cross @ cross  # Rodrigues
    u, _, vt = np.linalg.svd(turn @ pose.rotation)
    rotation = u @ vt
    return Pose(rotation, -rotation @ (pose.centre + step[3:]))


def _pinhole(camera: Camera) -> pycolmap.Camera:
    return pycolmap.Camera(
        model="SIMPLE_PINHOLE",
        width=camera.width,
        height=camera.height,
        params=[focal_of(camera), 0.0, 0.0],
    )
