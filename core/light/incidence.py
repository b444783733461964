"""Direction and irradiance of the light at surface points."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Protocol

import numpy as np
from numpy.typing import NDArray

from ..scan import Camera

Array = NDArray[np.float64]


@dataclass(frozen=True)
class Incidence:
    """Incident light at n surface points. towards: (n, 3) unit, surface → light, scan frame.
    irradiance: (n, 3) at normal incidence, photo units × sr. distance: (n,) to the light, scan
    units; None for a distant light."""

    towards: Array
    irradiance: Array
    distance: Array | None = None

    def select(self, which: NDArray) -> Incidence:
        """The rows of a boolean mask or an index array."""
        distance = None if self.distance is None else self.distance[which]
        return Incidence(_rows(self.towards, which), _rows(self.irradiance, which), distance)


def _rows(values: Array, which: NDArray) -> Array:
    """Rows of (n, 3) values; a broadcast row (of a distant light) stays a broadcast view."""
    if values.strides[0] == 0 and len(values):
        count = int(np.count_nonzero(which)) if which.dtype == bool else len(which)
        return np.broadcast_to(values[0], (count, values.shape[1]))
    return values[which]


class Light(Protocol):
    """A light of a capture."""

    @property
    def name(self) -> str:
        """Its name in the capture file."""

    @property
    def known(self) -> bool:
        """False where irradiance or intensity is unknown: reflectance then has no scale."""

    def incidence(self, points: Array, camera: Camera) -> Incidence:
        """Incident light at points (n, 3), scan frame, in the photo that ``camera`` takes."""
