"""Orthographic lens: a telecentric lens, or a photo from a large distance."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]


@dataclass(frozen=True)
class OrthographicLens:
    """x = scale_x · X + cx, y = scale_y · Y + cy for a point (X, Y, Z) in the camera's frame.

    scale_x, scale_y: pixels per scan unit; cx, cy: pixels. All rays run along z; :meth:`starts`
    returns their start points.
    """

    scale_x: float
    scale_y: float
    cx: float
    cy: float

    @property
    def focal_length_x(self) -> float:
        """Pixels per scan unit (there is no focal length)."""
        return self.scale_x

    @property
    def focal_length_y(self) -> float:
        """Pixels per scan unit."""
        return self.scale_y

    @property
    def principal_point_x(self) -> float:
        """Column of the pixel that the z axis meets, pixels."""
        return self.cx

    @property
    def principal_point_y(self) -> float:
        """Row of the pixel that the z axis meets, pixels."""
        return self.cy

    def is_undistorted(self) -> bool:
        """True: an orthographic lens has no distortion."""
        return True

    def img_from_cam(self, cam_points: Array) -> Array:
        """Pixels (n, 2) of points (n, 3)."""
        x, y = cam_points[:, 0], cam_points[:, 1]
        return np.stack([self.scale_x * x + self.cx, self.scale_y * y + self.cy], axis=1)

    def cam_ray_from_img(self, image_points: Array) -> Array:
        """Ray directions (n, 3) of pixels (n, 2): the z axis for all of them."""
        return np.tile((0.0, 0.0, 1.0), (len(image_points), 1))

    def cam_from_img(self, image_points: Array) -> Array:
        """(n, 2) coordinates X and Y of the points that pixels (n, 2) show, scan units."""
        return (image_points - (self.cx, self.cy)) / (self.scale_x, self.scale_y)

    def starts(self, image_points: Array) -> Array:
        """(n, 3) start points of the rays of pixels (n, 2), on the plane z = 0."""
        return np.c_[self.cam_from_img(image_points), np.zeros(len(image_points))]
