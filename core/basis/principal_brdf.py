"""A BRDF as coefficients in a basis (Ono et al. 2019, equation (3))."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from ..angles import Angles
from ..brdf import TabulatedBRDF
from .basis import Basis
from .log_table import LogTable


@dataclass(frozen=True)
class PrincipalBRDF:
    """An isotropic BRDF as coefficients (3, k) in a basis (equation (3)); coefficients without
    unit, ρ in 1/sr."""

    basis: Basis
    coefficients: NDArray[np.float64]

    @cached_property
    def log_table(self) -> LogTable:
        """The same BRDF with its components summed at the nodes: the cost of an evaluation does not
        depend on the number of components."""
        return LogTable.of(self.basis, self.coefficients)

    def evaluate(self, angles: Angles) -> NDArray[np.float32]:
        """ρ (..., 3) in 1/sr at half/difference angles (radians) of any shape."""
        each = np.broadcast_arrays(*angles)
        found = self.log_table.evaluate(Angles(*(np.ravel(a) for a in each)))
        return found.reshape(*each[0].shape, found.shape[1])

    def table(self) -> TabulatedBRDF:
        """The BRDF at the centres of the MERL cells."""
        return TabulatedBRDF.from_function(self.evaluate)
