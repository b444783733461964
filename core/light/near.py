"""A lamp near the object: its direction and irradiance differ from point to point."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from ..scan import Camera
from .incidence import Incidence

Array = NDArray[np.float64]


def irradiance_of_point(
    points: Array, position: Array, intensity: Array, axis: Array | None, beam: float | None
) -> Incidence:
    """Irradiance at normal incidence, E = I g(ϑ) / d², of a lamp much smaller than the distance d.

    points: (n, 3); position: (3,); intensity: (3,) irradiance at distance 1 on the axis. axis:
    (3,) unit, direction in which the lamp points; beam: radians, angle ϑ from the axis at which
    half of the intensity is left, g = 2^−(ϑ/beam)²; None for a lamp with the same intensity in all
    directions.
    """
    offset = position - points
    distance = np.linalg.norm(offset, axis=1)
    towards = offset / np.maximum(distance, 1e-12)[:, None]
    gain = 1.0 / np.maximum(distance, 1e-12) ** 2
    if axis is not None and beam is not None:
        angle = np.arccos(np.clip(-(towards @ axis), -1.0, 1.0))
        gain = gain * np.exp2(-((angle / beam) ** 2))
    return Incidence(towards, gain[:, None] * intensity, distance)


@dataclass(frozen=True)
class NearLight:
    """A lamp near the object. position: (3,) scan frame. intensity: (3,) irradiance at distance 1
    (scan units), with inverse-square falloff; None where unknown. radius: of the source, scan
    units. relative: intensity relative to the other lights of unknown intensity."""

    name: str
    position: Array
    intensity: Array | None = None
    radius: float = 0.0
    relative: float = 1.0

    @property
    def known(self) -> bool:
        """True where the intensity is known."""
        return self.intensity is not None

    def incidence(self, points: Array, camera: Camera) -> Incidence:
        """Incident light at points (n, 3), scan frame."""
        intensity = np.full(3, self.relative) if self.intensity is None else self.intensity
        return irradiance_of_point(points, self.position, intensity, None, None)


@dataclass(frozen=True)
class MountedLight:
    """A flash fixed to the camera. offset: (3,) in the camera's frame (x right, y down, z forward),
    scan units. intensity, radius: as for NearLight. beam: angle from the camera's axis at which
    half of the intensity is left, radians; None for the same intensity in all directions."""

    name: str
    offset: Array
    intensity: Array | None = None
    radius: float = 0.0
    beam: float | None = None

    @property
    def known(self) -> bool:
        """True where the intensity is known."""
        return self.intensity is not None

    def position(self, camera: Camera) -> Array:
        """(3,) its position in the photo of ``camera``, scan frame."""
        return camera.pose.rotation.T @ (self.offset - camera.pose.translation)

    def incidence(self, points: Array, camera: Camera) -> Incidence:
        """Incident light at points (n, 3), scan frame."""
        intensity = np.ones(3) if self.intensity is None else self.intensity
        axis = camera.pose.rotation[2]
        return irradiance_of_point(points, self.position(camera), intensity, axis, self.beam)
