"""A photo's camera: a lens (pycolmap is the camera-model library) and a pose."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import pycolmap
from numpy.typing import NDArray

Array = NDArray[np.float64]


@dataclass(frozen=True)
class Pose:
    """World → camera: x_cam = rotation · x_world + translation. x right, y down, z forward."""

    rotation: Array  # (3, 3), orthonormal
    translation: Array  # (3,), scan units

    @property
    def centre(self) -> Array:
        """(3,) the camera's centre in the scan's frame."""
        return -self.rotation.T @ self.translation


@dataclass(frozen=True)
class Camera:
    """One camera of the scan.

    label: the name its photo has in the scan (unique).
    model, parameters: COLMAP's camera model and its parameters, pixels; the centre of the top left
    pixel is at (0.5, 0.5).
    """

    label: str
    width: int
    height: int
    model: str
    parameters: tuple[float, ...]
    pose: Pose

    @property
    def lens(self) -> pycolmap.Camera:
        """The same camera as a pycolmap object."""
        return pycolmap.Camera(
            model=self.model, width=self.width, height=self.height, params=list(self.parameters)
        )

    @property
    def pinhole(self) -> bool:
        """True where the lens has neither distortion nor oblong pixels: a Blender camera is one."""
        lens = self.lens
        square = abs(lens.focal_length_x / lens.focal_length_y - 1.0) < 1e-7
        return bool(lens.is_undistorted()) and square

    def project(self, points: Array) -> Array:
        """Pixels (n, 2) of world points (n, 3); NaN behind the camera."""
        in_camera = points @ self.pose.rotation.T + self.pose.translation
        pixels = np.full((len(points), 2), np.nan)
        front = in_camera[:, 2] > 0
        if front.any():
            pixels[front] = self.lens.img_from_cam(in_camera[front])
        return pixels

    def rays(self, pixels: Array) -> Array:
        """Unit directions (n, 3), world frame, from the camera's centre through pixels (n, 2)."""
        directions = np.asarray(self.lens.cam_ray_from_img(np.ascontiguousarray(pixels)))
        directions = directions / np.linalg.norm(directions, axis=1, keepdims=True)
        return directions @ self.pose.rotation

    def rectified(self) -> Camera:
        """The distortion-free camera with square pixels nearest to this one: same size, same pose.

        Blender's cameras are such pinholes; the photo behind them is resampled with
        :func:`patina.core.photo.rectify`.
        """
        lens = self.lens
        focal = 0.5 * (lens.focal_length_x + lens.focal_length_y)
        cx, cy = lens.principal_point_x, lens.principal_point_y
        return Camera(
            self.label, self.width, self.height, "SIMPLE_PINHOLE", (focal, cx, cy), self.pose
        )
