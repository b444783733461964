"""Light as a surface point receives it."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Protocol

import numpy as np
from numpy.typing import NDArray

from ..scan import Camera

Array = NDArray[np.float64]


@dataclass(frozen=True)
class Incidence:
    """At n surface points. towards: (n, 3) unit, surface → light, scan frame. irradiance: (n, 3) at
    normal incidence, photo units × sr. distance: (n,) to the light, scan units; None: distant."""

    towards: Array
    irradiance: Array
    distance: Array | None = None

    def select(self, which: NDArray) -> Incidence:
        """The rows of a boolean mask or an index array."""
        distance = None if self.distance is None else self.distance[which]
        return Incidence(_rows(self.towards, which), _rows(self.irradiance, which), distance)


def _rows(values: Array, which: NDArray) -> Array:
    """Rows of (n, 3); of one row that stands for all (a distant light's) it stays one."""
    if values.strides[0] == 0 and len(values):
        count = int(np.count_nonzero(which)) if which.dtype == bool else len(which)
        return np.broadcast_to(values[0], (count, values.shape[1]))
    return values[which]


class Light(Protocol):
    """What lights a photo."""

    @property
    def name(self) -> str:
        """As the capture file calls it."""

    @property
    def known(self) -> bool:
        """False where irradiance or intensity is unknown: reflectance then has no scale."""

    def incidence(self, points: Array, camera: Camera) -> Incidence:
        """At points (n, 3), scan frame, while ``camera`` takes its photo."""
