"""A photo's camera: a lens and a pose."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from ..errors import PatinaError
from .lens import Lens, make_lens, resized_parameters
from .lenses.fold import beyond_fold

Array = NDArray[np.float64]

ROUNDED = 0.75  # pixels a side: what rounding the size of a scaled copy can cost
NO_SCALE = 0.02  # nobody scales a photo by less: it was cropped


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
    model, parameters: the lens (lens.py): one of COLMAP's camera models, or one of our own where
    COLMAP has none that is exact; pixels; the centre of the top left pixel is at (0.5, 0.5).
    photo: the photo's path as the scan's tool wrote it, where it did.
    """

    label: str
    width: int
    height: int
    model: str
    parameters: tuple[float, ...]
    pose: Pose
    photo: str | None = None

    @property
    def lens(self) -> Lens:
        """The lens, in its own frame."""
        return make_lens(self.model, self.width, self.height, self.parameters)

    @property
    def orthographic(self) -> bool:
        """True where all rays are parallel."""
        return self.model == "ORTHOGRAPHIC"

    @property
    def panoramic(self) -> bool:
        """True for a lens that also sees behind itself: no Blender camera stands for it."""
        return self.model == "EQUIRECTANGULAR"

    @property
    def pinhole(self) -> bool:
        """True where the lens has neither distortion nor oblong pixels: a Blender camera is one."""
        if self.panoramic:
            return False
        lens = self.lens
        square = abs(lens.focal_length_x / lens.focal_length_y - 1.0) < 1e-7
        return bool(lens.is_undistorted()) and square

    def project(self, points: Array) -> Array:
        """Pixels (n, 2) of world points (n, 3); NaN behind the camera."""
        in_camera = points @ self.pose.rotation.T + self.pose.translation
        pixels = np.full((len(points), 2), np.nan)
        front = in_camera[:, 2] > 0
        if self.panoramic:
            front = np.ones(len(points), bool)
        if front.any():
            pixels[front] = self.lens.img_from_cam(np.ascontiguousarray(in_camera[front]))
            # a polynomial lens folds: what lies far outside must not come back into the photo
            pixels[beyond_fold(self.model, self.parameters, in_camera)] = np.nan
        return pixels

    def rays(self, pixels: Array) -> Array:
        """Unit directions (n, 3), world frame, from the camera through pixels (n, 2)."""
        directions = np.asarray(self.lens.cam_ray_from_img(np.ascontiguousarray(pixels)))
        directions = directions / np.linalg.norm(directions, axis=1, keepdims=True)
        return directions @ self.pose.rotation

    def ray_starts(self, pixels: Array) -> Array:
        """(3,) where all rays start, world frame; (n, 3) for an orthographic camera."""
        lens = self.lens
        if not hasattr(lens, "starts"):
            return self.pose.centre
        return (lens.starts(pixels) - self.pose.translation) @ self.pose.rotation

    def footprint(self, depth: NDArray[np.floating]) -> NDArray[np.floating]:
        """The width of a pixel at a depth along the ray, scan units (any shape)."""
        lens = self.lens
        focal = 0.5 * (lens.focal_length_x + lens.focal_length_y)
        if self.panoramic:
            focal = self.width / (2 * np.pi)
        return np.full_like(depth, 1.0 / focal) if self.orthographic else depth / focal

    def rectified(self) -> Camera:
        """The distortion-free camera with square pixels nearest to this one: same size, same pose.

        Blender's cameras are such pinholes; the photo behind them is resampled with
        :func:`patina.core.geometry.rectify.rectify`.
        """
        lens = self.lens
        cx, cy = lens.principal_point_x, lens.principal_point_y
        focal = 0.5 * (lens.focal_length_x + lens.focal_length_y)
        if self.orthographic:
            return replace(self, parameters=(focal, focal, cx, cy))
        if self.panoramic:  # its forward third
            focal, cx, cy = self.width / 4, self.width / 2, self.height / 2
        return replace(self, model="SIMPLE_PINHOLE", parameters=(focal, cx, cy))

    def resized(self, width: int, height: int) -> Camera:
        """The camera of a scaled copy of its photo. Raises PatinaError where the aspect differs:
        the photo was cropped or turned."""
        if (width, height) == (self.width, self.height):
            return self
        least = max((width - ROUNDED) / self.width, (height - ROUNDED) / self.height)
        most = min((width + ROUNDED) / self.width, (height + ROUNDED) / self.height)
        cropped = abs(width / self.width - 1.0) < NO_SCALE
        if least > most or cropped:
            quarter = (height > width) != (self.height > self.width)
            turned = " (is it turned by a quarter?)" if quarter else ""
            raise PatinaError(
                f"{width} × {height} pixels are no scaled copy of the camera's {self.width} × "
                f"{self.height}{turned}"
            )
        parameters = resized_parameters(
            self.model, self.parameters, (self.width, self.height), (width, height)
        )
        return replace(self, width=width, height=height, parameters=parameters)
