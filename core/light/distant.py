"""A distant light: the same direction and irradiance everywhere on the object."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from ..scan import Camera
from .incidence import Incidence

Array = NDArray[np.float64]


@dataclass(frozen=True)
class DistantLight:
    """A distant light.

    direction: (3,) unit, surface → light, scan frame. irradiance: (3,) at normal incidence, in
    radiance units of the photos × sr; None where unknown (the BRDF is then known up to a scale).
    angular_radius: of the source, radians (the sun's is 0.00465). relative: irradiance relative to
    the other lights of unknown irradiance.
    """

    name: str
    direction: Array
    irradiance: Array | None = None
    angular_radius: float = 0.0
    relative: float = 1.0

    @property
    def known(self) -> bool:
        """True where the irradiance is known."""
        return self.irradiance is not None

    @property
    def effective_irradiance(self) -> Array:
        """(3,) the irradiance, or the relative one where unknown."""
        return np.full(3, self.relative) if self.irradiance is None else self.irradiance

    def incidence(self, points: Array, camera: Camera) -> Incidence:
        """Incident light at points (n, 3), the same at all of them."""
        n = len(points)
        return Incidence(
            np.broadcast_to(self.direction, (n, 3)),
            np.broadcast_to(self.effective_irradiance, (n, 3)),
        )
