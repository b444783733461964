"""One distant light: the same direction and irradiance everywhere on the object."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray


@dataclass(frozen=True)
class DistantLight:
    """direction: (3,) unit, surface → light, scan frame. irradiance: (3,) at normal incidence, in
    radiance units of the photos × sr; None where unknown (the BRDF is then known up to a scale)."""

    name: str
    direction: NDArray[np.float64]
    irradiance: NDArray[np.float64] | None = None

    @property
    def effective_irradiance(self) -> NDArray[np.float64]:
        """(3,) the irradiance, or 1 where unknown."""
        return np.ones(3) if self.irradiance is None else self.irradiance
