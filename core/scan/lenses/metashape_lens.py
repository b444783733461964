"""Metashape's lenses, where no camera model of COLMAP is exact.

Agisoft Metashape Professional, User Manual, appendix "Camera models". Frame: x = X/Z, y = Y/Z;
(equidistant) fisheye: x = θ·X/R, y = θ·Y/R; equisolid fisheye (since 2.3): 2 sin(θ/2) instead of θ.
Then the distortion of metashape_distortion.py for all of them, and

    u = cx + x' f + x' b1 + y' b2,   v = cy + y' f

cx, cy are offsets from the photo's centre in the manual, and absolute here; the centre of the top
left pixel is at (0.5, 0.5) in both.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import astuple, dataclass

import numpy as np
from numpy.typing import NDArray

from .fold import fold_radius
from .metashape_distortion import Calibration, determinant, distort, undistort

Array = NDArray[np.float64]

MODELS = ("METASHAPE_FRAME", "METASHAPE_FISHEYE", "METASHAPE_EQUISOLID")


def metashape_lens(model: str, parameters: Sequence[float]) -> MetashapeLens:
    """The lens of one of MODELS with the 13 parameters of :class:`Calibration`, in its order.

    Raises ValueError for another model or number of parameters.
    """
    if model not in MODELS:
        raise ValueError(f"found the model {model}; expected one of {', '.join(MODELS)}")
    if len(parameters) != 13:
        raise ValueError(f"{model} has 13 parameters; found {len(parameters)}")
    return MetashapeLens(model, Calibration(*(float(p) for p in parameters)))


def resized(
    model: str, parameters: Sequence[float], across: float, down: float
) -> tuple[float, ...]:
    """The parameters for a photo ``across`` times as wide and ``down`` times as high. Exact: f
    scales with the height, and b1 takes up the difference of the two scales."""
    lens = metashape_lens(model, parameters).calibration
    f = lens.f * down
    values = {
        "f": f,
        "cx": lens.cx * across,
        "cy": lens.cy * down,
        "b1": (lens.f + lens.b1) * across - f,
        "b2": lens.b2 * across,
    }
    return astuple(lens.__class__(**{**vars(lens), **values}))


def colmap_model(model: str, lens: Calibration) -> tuple[str, tuple[float, ...]]:
    """(model, parameters) of the same lens: the simplest exact COLMAP model, else ``model`` itself.

    COLMAP's fisheyes distort θ as Metashape's do (models.h, OpenCVFisheyeCameraModel and
    ThinPrismFisheyeCameraModel). No COLMAP model has k4 with a perspective projection, p3, p4 or
    b2.
    """
    own = model, astuple(lens)
    if lens.b2 != 0 or (lens.tangential and (lens.p3 != 0 or lens.p4 != 0)):
        return own
    focal = lens.f + lens.b1, lens.f, lens.cx, lens.cy
    if model == "METASHAPE_FRAME" and lens.k4 == 0:
        if not (lens.tangential or any(lens.radial)):
            if lens.b1 == 0:
                return "SIMPLE_PINHOLE", focal[1:]
            return "PINHOLE", focal
        brown = lens.k1, lens.k2, lens.p2, lens.p1
        if lens.k3 == 0:
            return "OPENCV", (*focal, *brown)
        return "FULL_OPENCV", (*focal, *brown, lens.k3, 0.0, 0.0, 0.0)
    if model == "METASHAPE_FISHEYE":
        if not lens.tangential:
            return "OPENCV_FISHEYE", (*focal, *lens.radial)
        brown = lens.k1, lens.k2, lens.p2, lens.p1
        return "THIN_PRISM_FISHEYE", (*focal, *brown, lens.k3, lens.k4, 0.0, 0.0)
    return own


@dataclass(frozen=True)
class MetashapeLens:
    """One of MODELS, a :class:`patina.core.scan.lens.Lens`. NaN for pixels of points beyond the
    fold of the polynomial (fold.py), and for rays of pixels beyond it."""

    model: str
    calibration: Calibration

    @property
    def focal_length_x(self) -> float:
        """Pixels per unit of x/z at the centre."""
        return self.calibration.f + self.calibration.b1

    @property
    def focal_length_y(self) -> float:
        """Pixels per unit of y/z at the centre."""
        return self.calibration.f

    @property
    def principal_point_x(self) -> float:
        """Pixels."""
        return self.calibration.cx

    @property
    def principal_point_y(self) -> float:
        """Pixels."""
        return self.calibration.cy

    def is_undistorted(self) -> bool:
        """True for a frame lens without distortion. False with skew (b2): that is linear, but a
        pinhole with two focal lengths does not represent it."""
        lens = self.calibration
        bent = lens.tangential or any(lens.radial) or lens.b2 != 0
        return self.model == "METASHAPE_FRAME" and not bent

    def img_from_cam(self, cam_points: Array) -> Array:
        """Pixels (n, 2) of points (n, 3) in the camera's frame."""
        x, y = self._flattened(np.asarray(cam_points, np.float64))
        with np.errstate(invalid="ignore", over="ignore"):
            bent_x, bent_y, jacobian = distort(self.calibration, x, y)
            kept = (np.hypot(x, y) <= self._limit) & (determinant(jacobian) > 0)
        lens = self.calibration
        u = lens.cx + bent_x * (lens.f + lens.b1) + bent_y * lens.b2
        v = lens.cy + bent_y * lens.f
        return np.where(kept[:, None], np.stack([u, v], axis=1), np.nan)

    def cam_ray_from_img(self, image_points: Array) -> Array:
        """Directions (n, 3), not normalised, of pixels (n, 2)."""
        x, y = self._straightened(image_points)
        if self.model == "METASHAPE_FRAME":
            return np.stack([x, y, np.where(np.isnan(x), np.nan, 1.0)], axis=1)
        radius = np.hypot(x, y)
        angle = 2 * np.arcsin(radius / 2) if self.model == "METASHAPE_EQUISOLID" else radius
        with np.errstate(invalid="ignore", divide="ignore"):
            sine = np.where(radius > 0, np.sin(angle) / radius, 1.0)
        return np.stack([x * sine, y * sine, np.cos(angle)], axis=1)

    def cam_from_img(self, image_points: Array) -> Array:
        """(n, 2): x/z and y/z of pixels (n, 2); NaN at 90° from the axis and beyond."""
        ray = self.cam_ray_from_img(image_points)
        with np.errstate(invalid="ignore", divide="ignore"):
            flat: Array = ray[:, :2] / np.where(ray[:, 2:] > 0, ray[:, 2:], np.nan)
        return flat

    @property
    def _limit(self) -> float:
        """The largest undistorted radius that the lens maps."""
        widest = {"METASHAPE_FISHEYE": np.pi, "METASHAPE_EQUISOLID": 2.0}
        return min(fold_radius(self.calibration.radial), widest.get(self.model, np.inf))

    def _flattened(self, points: Array) -> tuple[Array, Array]:
        """x, y before distortion; NaN where the point has no projection."""
        across, z = np.hypot(points[:, 0], points[:, 1]), points[:, 2]
        with np.errstate(invalid="ignore", divide="ignore"):
            if self.model == "METASHAPE_FRAME":
                factor = np.where(z > 0, 1.0 / z, np.nan)
            else:
                angle = np.arctan2(across, z)
                solid = self.model == "METASHAPE_EQUISOLID"
                radius = 2 * np.sin(angle / 2) if solid else angle
                on_axis = np.where(z > 0, 1.0 / z, np.nan)
                factor = np.where(across > 0, radius / across, on_axis)
        return points[:, 0] * factor, points[:, 1] * factor

    def _straightened(self, image_points: Array) -> tuple[Array, Array]:
        """x, y before distortion of pixels (n, 2); NaN where no ray reaches the pixel."""
        pixels = np.asarray(image_points, np.float64)
        lens = self.calibration
        bent_y = (pixels[:, 1] - lens.cy) / lens.f
        bent_x = (pixels[:, 0] - lens.cx - bent_y * lens.b2) / (lens.f + lens.b1)
        return undistort(lens, bent_x, bent_y, self._limit)
