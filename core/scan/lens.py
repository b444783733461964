"""Lenses: pycolmap's camera models, and Patina's own where pycolmap has no exact one."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Protocol

import numpy as np
import pycolmap
from numpy.typing import NDArray

Array = NDArray[np.float64]


class Lens(Protocol):
    """Interface of a lens; pycolmap.Camera implements it. Camera frame: x right, y down, z forward;
    the centre of the top left pixel is at (0.5, 0.5)."""

    @property
    def focal_length_x(self) -> float:
        """Pixels per unit of x/z at the image's centre."""

    @property
    def focal_length_y(self) -> float:
        """Pixels per unit of y/z at the image's centre."""

    @property
    def principal_point_x(self) -> float:
        """Pixels."""

    @property
    def principal_point_y(self) -> float:
        """Pixels."""

    def is_undistorted(self) -> bool:
        """True where img_from_cam is linear in x/z and y/z."""

    def img_from_cam(self, cam_points: Array) -> Array:
        """Pixels (n, 2) of points (n, 3) in the camera's frame, in front of it."""

    def cam_ray_from_img(self, image_points: Array) -> Array:
        """Directions (n, 3) in the camera's frame of pixels (n, 2)."""

    def cam_from_img(self, image_points: Array) -> Array:
        """(n, 2): x/z and y/z of pixels (n, 2)."""


def make_lens(model: str, width: int, height: int, parameters: Sequence[float]) -> Lens:
    """A lens by the name of its model: one of COLMAP's, METASHAPE_FRAME, METASHAPE_FISHEYE or
    METASHAPE_EQUISOLID (metashape_lens.py), MEASURED_RADIAL (measured_radial_lens.py) or
    ORTHOGRAPHIC (orthographic.py). Raises ValueError."""
    if model == "ORTHOGRAPHIC":
        from .lenses.orthographic import OrthographicLens

        return OrthographicLens(*parameters)
    if model.startswith("METASHAPE_"):
        from .lenses.metashape_lens import metashape_lens

        return metashape_lens(model, parameters)
    if model == "MEASURED_RADIAL":
        from .lenses.measured_radial_lens import MeasuredRadialLens

        return MeasuredRadialLens(*parameters)
    return pycolmap.Camera(model=model, width=width, height=height, params=list(parameters))


def resized_parameters(
    model: str, parameters: Sequence[float], old: tuple[int, int], new: tuple[int, int]
) -> tuple[float, ...]:
    """The lens's parameters for a scaled copy of the photo, ``new`` instead of ``old`` pixels
    (width, height)."""
    across, down = new[0] / old[0], new[1] / old[1]
    if model == "ORTHOGRAPHIC":
        scale_x, scale_y, cx, cy = parameters
        return scale_x * across, scale_y * down, cx * across, cy * down
    if model.startswith("METASHAPE_"):
        from .lenses.metashape_lens import resized

        return resized(model, parameters, across, down)
    if model == "MEASURED_RADIAL":
        from .lenses.measured_radial_lens import resized as resized_measured

        return resized_measured(tuple(parameters), across, down)
    lens = pycolmap.Camera(model=model, width=old[0], height=old[1], params=list(parameters))
    lens.rescale(*new)
    return tuple(float(p) for p in lens.params)
