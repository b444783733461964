"""VisualSFM's lens: its polynomial maps distorted pixels to undistorted ones, not the reverse.

C. Wu, "Multicore bundle adjustment" (PBA): with m = (pixel − centre) / f the undistorted ray is m
(1 + r |m|²). COLMAP has no such model (its SIMPLE_DIVISION divides).
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]

MODEL = "MEASURED_RADIAL"  # parameters: f, cx, cy, r


@dataclass(frozen=True)
class MeasuredRadialLens:
    """(x/z, y/z) = m (1 + r |m|²), m = ((px − cx) / f, (py − cy) / f). f, cx, cy: pixels."""

    f: float
    cx: float
    cy: float
    r: float

    @property
    def focal_length_x(self) -> float:
        """Pixels."""
        return self.f

    @property
    def focal_length_y(self) -> float:
        """Pixels."""
        return self.f

    @property
    def principal_point_x(self) -> float:
        """Pixels."""
        return self.cx

    @property
    def principal_point_y(self) -> float:
        """Pixels."""
        return self.cy

    def is_undistorted(self) -> bool:
        """True without distortion."""
        return self.r == 0.0

    def img_from_cam(self, cam_points: Array) -> Array:
        """Pixels (n, 2) of points (n, 3); NaN beyond the rays of all pixels.

        The real root of r m³ + m = ρ that tends to ρ for r → 0, in closed form (hyperbolic for r >
        0, trigonometric for r < 0).
        """
        straight = cam_points[:, :2] / cam_points[:, 2:]
        if self.r == 0.0:
            return straight * self.f + (self.cx, self.cy)
        radius = np.linalg.norm(straight, axis=1)
        root = np.sqrt(3.0 * abs(self.r))
        with np.errstate(invalid="ignore"):  # arcsin beyond 1: no pixel
            if self.r > 0:
                measured = 2.0 / root * np.sinh(np.arcsinh(1.5 * root * radius) / 3.0)
            else:
                measured = 2.0 / root * np.sin(np.arcsin(1.5 * root * radius) / 3.0)
        ratio = np.divide(measured, radius, out=np.ones_like(radius), where=radius > 0)
        return straight * (self.f * ratio[:, None]) + (self.cx, self.cy)

    def cam_from_img(self, image_points: Array) -> Array:
        """(n, 2): x/z and y/z of pixels (n, 2); NaN beyond the fold of the polynomial."""
        measured = (image_points - (self.cx, self.cy)) / self.f
        bent = self.r * (measured**2).sum(axis=1, keepdims=True)
        return np.where(1.0 + 3.0 * bent > 0, measured * (1.0 + bent), np.nan)

    def cam_ray_from_img(self, image_points: Array) -> Array:
        """Directions (n, 3) of pixels (n, 2)."""
        rays = np.c_[self.cam_from_img(image_points), np.ones(len(image_points))]
        return rays / np.linalg.norm(rays, axis=1, keepdims=True)


def resized(parameters: tuple[float, ...], across: float, down: float) -> tuple[float, ...]:
    """The parameters for a photo scaled by these factors."""
    f, cx, cy, r = parameters
    return f * 0.5 * (across + down), cx * across, cy * down, r
