"""The BRDFs of all materials of a capture, and their derivatives by the coefficients."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from ...angles import Angles
from ...basis import Basis, PrincipalBRDF, mapping
from ...basis.log_table import LogTable
from . import basis_slack
from .shading_state import ShadingState

Array = NDArray[np.floating]


@dataclass(frozen=True)
class MaterialBRDFs:
    """coefficients: (m, 3, k) of m materials in a basis with slack (basis_slack.py). variance: (k,)
    prior variances of the coefficients. scale: (m,) factor of each material's reflectance, None 1:
    the logarithmic mapping has an offset, so the basis holds materials of its own brightness."""

    basis: Basis
    coefficients: NDArray[np.float64]
    variance: NDArray[np.float64]
    scale: NDArray[np.float64] | None = None

    @classmethod
    def of(cls, brdfs: Sequence[PrincipalBRDF]) -> MaterialBRDFs:
        """The given BRDFs, all in one basis, with additional components for a small deviation from
        the basis (slack)."""
        basis = brdfs[0].basis
        variance = basis_slack.variances(basis, basis_slack.DEFAULT_SCALE)
        coefficients = np.zeros((len(brdfs), 3, len(variance)))
        for index, brdf in enumerate(brdfs):
            coefficients[index, :, : brdf.coefficients.shape[1]] = brdf.coefficients
        return cls(basis_slack.with_slack(basis), coefficients, variance)

    @classmethod
    def without_slack(cls, brdf: PrincipalBRDF) -> MaterialBRDFs:
        """A single BRDF without slack, for predictions. Its prior variances are 0, so it cannot be
        fitted."""
        variance = np.zeros(brdf.coefficients.shape[1])
        return cls(brdf.basis, brdf.coefficients[None], variance)

    @cached_property
    def tables(self) -> tuple[LogTable, ...]:
        """A table of logarithms for each material."""
        return tuple(LogTable.of(self.basis, c) for c in self.coefficients)

    def evaluate_one(self, index: int, angles: Angles) -> Array:
        """ρ (n, 3), 1/sr, of the paper's equation (3), of one material at n directions."""
        rho = self.tables[index].evaluate(angles)
        return rho if self.scale is None else rho * np.float32(self.scale[index])

    def evaluate(self, angles: Angles, material: NDArray[np.integer]) -> Array:
        """The same; material: (n,) of each direction."""
        out = np.zeros((len(material), 3), np.float32)
        for index in range(len(self.coefficients)):
            rows = np.flatnonzero(material == index)
            if len(rows):
                out[rows] = self.evaluate_one(index, Angles(*(a.take(rows) for a in angles)))
        return out

    def reflected(self, state: ShadingState) -> Array:
        """(n, 3) reflected radiance of the lamp."""
        return self.evaluate(state.angles, state.pixels.material) * state.received

    def log_derivative(self, state: ShadingState) -> Array:
        """(n, 3) derivative of the reflected radiance by ln(ρ·cosMap + ε)."""
        return self.reflected(state) + self._offset(state)

    def reflected_with_derivative(self, state: ShadingState) -> Array:
        """(n, 6) reflected radiance and log_derivative."""
        reflected = self.reflected(state)
        return np.concatenate([reflected, reflected + self._offset(state)], axis=1)

    def rows(self, angles: Angles) -> Array:
        """(n, k) rows Q̂ of the basis. The derivative of ρ by the coefficients is
        (ρ + scale · ε / cosMap) Q̂."""
        return self.basis.rows(angles, self.coefficients.shape[2])[1]

    def _offset(self, state: ShadingState) -> Array:
        """(n, 3) reflected radiance of a BRDF ε / cosMap, the offset of the logarithmic mapping."""
        offset = mapping.EPSILON / mapping.cos_map(state.angles)
        if self.scale is not None:
            offset = offset * self.scale.astype(np.float32)[state.pixels.material]
        return offset[:, None] * state.received
