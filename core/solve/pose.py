"""A camera's pose from pixels and the scan's points they show (perspective-n-point)."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import pycolmap
from numpy.typing import NDArray

from ..scan import Camera, Pose

Array = NDArray[np.float64]
MAX_SLOPE = 5.0  # of x/z and y/z; it is infinite at 90° from the axis of a fisheye
MAX_TRIALS = 20_000
HUBER = 1.345  # in units of the residuals' σ: 95 % efficiency for normal residuals (Huber 1981)


@dataclass(frozen=True)
class FoundPose:
    """pose; inliers: (n,) bool; error: median distance of the inliers, pixels; covariance: (6, 6)
    of the rotation about the camera's axes (radians) and of its centre (scan units);
    pixel_deviation: standard deviation of projected points, pixels."""

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


def undistorted(camera: Camera, pixels: Array) -> Array:
    """(n, 2) pixels of the distortion-free camera with the same focal length and its principal
    point at (0, 0); NaN where |x/z| or |y/z| reaches MAX_SLOPE."""
    flat = np.asarray(camera.lens.cam_from_img(np.ascontiguousarray(pixels)), np.float64)
    flat = flat.reshape(len(pixels), 2)
    with np.errstate(invalid="ignore"):
        too_steep = ~(np.abs(flat).max(axis=1) < MAX_SLOPE)
    flat[too_steep] = np.nan
    return flat * focal_of(camera)


def find_pose(camera: Camera, pixels: Array, points: Array, limit: float) -> FoundPose | None:
    """The camera's pose (its own pose is ignored) that projects most points (n, 3) within ``limit``
    pixels of pixels (n, 2), most of which may be outliers; None where no pose has enough inliers.

    LO-RANSAC with the P3P solver, then least squares with a Cauchy loss (pycolmap).
    """
    flat = undistorted(camera, pixels)
    usable = np.isfinite(flat).all(axis=1) & np.isfinite(points).all(axis=1)
    if usable.sum() < 6:
        return None
    origin = np.median(points[usable], axis=0)  # georeferenced coordinates are large
    options = pycolmap.AbsolutePoseEstimationOptions()
    options.ransac.max_error = limit
    options.ransac.min_inlier_ratio = 0.01
    options.ransac.max_num_trials = MAX_TRIALS
    options.ransac.random_seed = 0
    found = pycolmap.estimate_and_refine_absolute_pose(
        flat[usable], points[usable] - origin, _pinhole(camera), options
    )
    if found is None:
        return None
    rigid = found["cam_from_world"]
    pose = Pose(np.array(rigid.rotation.matrix()), np.array(rigid.translation))
    pose = Pose(pose.rotation, pose.translation - pose.rotation @ origin)
    return with_uncertainty(camera, pose, flat, points, limit)


def refine_pose(
    camera: Camera, start: Pose, pixels: Array, points: Array, limit: float
) -> FoundPose | None:
    """The pose near ``start`` that best fits the points within ``limit`` pixels: Gauss-Newton with
    Huber's weights. None for fewer than 6 inliers."""
    flat = undistorted(camera, pixels)
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
    return with_uncertainty(camera, pose, flat, points, limit)


def with_uncertainty(
    camera: Camera, pose: Pose, flat: Array, points: Array, limit: float
) -> FoundPose | None:
    """The pose with its inliers and covariance. The covariance is that of least squares, scaled by
    the scatter of the inliers. It does not include errors common to all of them, such as a deformed
    mesh."""
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
    """σ of one coordinate, from the median distance (the median of a Rayleigh distribution is
    1.1774 σ)."""
    return max(float(np.median(np.linalg.norm(offset, axis=1))) / 1.1774, 1e-6)


def _linearised(
    pose: Pose, flat: Array, points: Array, focal: float
) -> tuple[Array, Array, NDArray[np.bool_]]:
    """(observed − projected (n, 2), derivative of projected (n, 2, 6), in front and finite
    (n,))."""
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
