"""A photo's camera: a lens and a pose."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from ..errors import PatinaError
from .lens import Lens, make_lens, resized_parameters
from .lenses.fold import beyond_fold

Array = NDArray[np.float64]

SIZE_ROUNDING = 0.75  # pixels per side that rounding can change the size of a scaled copy by
MIN_SCALE_CHANGE = 0.02  # a smaller relative change of the width means that the photo was cropped


@dataclass(frozen=True)
class Pose:
    """World → camera: x_cam = rotation · x_world + translation. x right, y down, z forward."""

    rotation: Array  # (3, 3), orthonormal
    translation: Array  # (3,), scan units

    @property
    def centre(self) -> Array:
        """(3,) the camera's centre in the scan's frame, scan units."""
        return -self.rotation.T @ self.translation


@dataclass(frozen=True)
class Camera:
    """One camera of the scan.

    label: unique name of its photo in the scan. model, parameters: the lens (lens.py): one of
    COLMAP's camera models, or one of Patina's own where COLMAP has no exact one. Pixels; the centre
    of the top left pixel is at (0.5, 0.5). photo: path of the photo as the scan's tool wrote it,
    where available.
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
        """True for a lens that covers the whole sphere. No Blender camera represents it."""
        return self.model == "EQUIRECTANGULAR"

    @property
    def pinhole(self) -> bool:
        """True where the lens has no distortion and square pixels, so that a Blender camera
        represents it."""
        if self.panoramic:
            return False
        lens = self.lens
        square = abs(lens.focal_length_x / lens.focal_length_y - 1.0) < 1e-7
        return bool(lens.is_undistorted()) and square

    def in_front(self, points: Array) -> NDArray[np.bool_]:
        """(n,) whether world points (n, 3) are in front of the camera. Nothing is behind an
        orthographic one: its rays start in front of the whole object."""
        if self.panoramic or self.orthographic:
            return np.ones(len(points), bool)
        return np.asarray(points @ self.pose.rotation[2] + self.pose.translation[2] > 0)

    def project(self, points: Array) -> Array:
        """Pixels (n, 2) of world points (n, 3); NaN behind the camera."""
        in_camera = points @ self.pose.rotation.T + self.pose.translation
        pixels = np.full((len(points), 2), np.nan)
        front = self.in_front(points)
        if front.any():
            pixels[front] = self.lens.img_from_cam(np.ascontiguousarray(in_camera[front]))
            # a distortion polynomial can fold points far outside back into the photo
            pixels[beyond_fold(self.model, self.parameters, in_camera)] = np.nan
        return pixels

    def rays(self, pixels: Array) -> Array:
        """Unit directions (n, 3), world frame, from the camera through pixels (n, 2)."""
        directions = np.asarray(self.lens.cam_ray_from_img(np.ascontiguousarray(pixels)))
        directions = directions / np.linalg.norm(directions, axis=1, keepdims=True)
        return directions @ self.pose.rotation

    def ray_starts(self, pixels: Array) -> Array:
        """(3,) start of all rays, world frame; (n, 3) for an orthographic camera."""
        lens = self.lens
        if not hasattr(lens, "starts"):
            return self.pose.centre
        return (lens.starts(pixels) - self.pose.translation) @ self.pose.rotation

    def footprint(self, depth: NDArray[np.floating]) -> NDArray[np.floating]:
        """Width of a pixel at a depth along the ray, scan units (any shape)."""
        lens = self.lens
        focal = 0.5 * (lens.focal_length_x + lens.focal_length_y)
        if self.panoramic:
            focal = self.width / (2 * np.pi)
        return np.full_like(depth, 1.0 / focal) if self.orthographic else depth / focal

    def rectified(self) -> Camera:
        """The nearest distortion-free camera with square pixels, of the same size and pose.

        Blender's cameras are such pinholes. The photo is resampled for them with
        :func:`patina.core.geometry.rectify.rectify`.
        """
        lens = self.lens
        cx, cy = lens.principal_point_x, lens.principal_point_y
        focal = 0.5 * (lens.focal_length_x + lens.focal_length_y)
        if self.orthographic:
            return replace(self, parameters=(focal, focal, cx, cy))
        if self.panoramic:  # 127° around the forward direction
            focal, cx, cy = self.width / 4, self.width / 2, self.height / 2
        return replace(self, model="SIMPLE_PINHOLE", parameters=(focal, cx, cy))

    def resized(self, width: int, height: int) -> Camera:
        """The camera of a scaled copy of its photo. Raises PatinaError where the aspect ratio
        differs: the photo was cropped or rotated."""
        if (width, height) == (self.width, self.height):
            return self
        min_scale = max(
            (width - SIZE_ROUNDING) / self.width, (height - SIZE_ROUNDING) / self.height
        )
        max_scale = min(
            (width + SIZE_ROUNDING) / self.width, (height + SIZE_ROUNDING) / self.height
        )
        cropped = abs(width / self.width - 1.0) < MIN_SCALE_CHANGE
        if min_scale > max_scale or cropped:
            quarter = (height > width) != (self.height > self.width)
            rotated = " (is it rotated by 90°?)" if quarter else ""
            raise PatinaError(
                f"the photo has {width} × {height} pixels; expected a scaled copy of the camera's "
                f"{self.width} × {self.height}{rotated}; do not crop or rotate it"
            )
        parameters = resized_parameters(
            self.model, self.parameters, (self.width, self.height), (width, height)
        )
        return replace(self, width=width, height=height, parameters=parameters)
