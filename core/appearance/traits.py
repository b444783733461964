"""Edits of a measured BRDF: some of its coefficients are shifted, the rest stay as measured.

Shifts are in standard deviations of the training coefficients (sqrt(1/columns), the same for every
component), so 1 is a typical difference between materials of the training set. ln(ρ·cosMap + ε) is
linear in the coefficients: for fixed directions (of a sphere, of a hemisphere) the components are
looked up once, and a shift costs one product with a thin matrix.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from ..angles import Angles
from ..basis import Basis, PrincipalBRDF, mapping
from .energy import Hemispheres
from .osl_atlas import traits

Array = NDArray[np.floating]

VIEWS = tuple(np.radians((0.0, 30.0, 50.0, 65.0, 75.0, 82.0, 87.0)))  # θo of the albedo, radians
ALBEDO_TOLERANCE = 0.01  # by which an albedo may exceed 1: the error of the quadrature


def shift_unit(basis: Basis) -> float:
    """Change of a coefficient for a shift of 1: its standard deviation in the training set."""
    return float(np.sqrt(basis.coefficient_variance))


def shifted(brdf: PrincipalBRDF, shifts: Array) -> PrincipalBRDF:
    """The BRDF with shifts (3, n) of R, G, B added to its first n components, in standard
    deviations. Without shifts it is the same object."""
    if not np.any(shifts):
        return brdf
    coefficients = np.array(brdf.coefficients, np.float64)
    count = min(shifts.shape[1], coefficients.shape[1])
    coefficients[:, :count] += shift_unit(brdf.basis) * np.asarray(shifts, np.float64)[:, :count]
    return PrincipalBRDF(brdf.basis, coefficients)


@dataclass(frozen=True)
class ComponentLookup:
    """The first components at n directions, independent of material and shifts.

    slopes: (n, traits) change of ln(ρ·cosMap + ε) for a shift of 1; weight: (n,) cosMap.
    """

    angles: Angles
    slopes: NDArray[np.float32]
    weight: Array

    @classmethod
    def of(cls, basis: Basis, angles: Angles) -> ComponentLookup:
        """At directions (n,)."""
        _, rows = basis.rows(angles, traits(basis.count))
        step = np.float32(shift_unit(basis))
        return cls(angles, np.ascontiguousarray(step * rows), mapping.cos_map(angles))


@dataclass(frozen=True)
class ShiftableBRDF:
    """A BRDF at these directions, prepared for shifts. logs: (n, 3) ln(ρ·cosMap + ε) as
    measured."""

    lookup: ComponentLookup
    logs: NDArray[np.float32]

    @classmethod
    def of(cls, brdf: PrincipalBRDF, lookup: ComponentLookup) -> ShiftableBRDF:
        """For a BRDF without shifts."""
        return cls(lookup, brdf.log_table.logs(lookup.angles))

    def at(self, shifts: Array) -> Array:
        """ρ (n, 3) in 1/sr with shifts (3, m), m at most the number of components looked up;
        without shifts bit-identical to the BRDF itself."""
        slopes = self.lookup.slopes[:, : shifts.shape[1]]
        logs = (
            self.logs + slopes @ np.asarray(shifts, np.float32).T if np.any(shifts) else self.logs
        )
        return mapping.unlog_weighted(logs, self.lookup.weight).astype(np.float32)


@dataclass(frozen=True)
class ShiftableAlbedo:
    """Directional albedo of a BRDF for each of VIEWS, prepared for shifts."""

    hemispheres: Hemispheres
    movable: ShiftableBRDF

    @classmethod
    def of(cls, brdf: PrincipalBRDF) -> ShiftableAlbedo:
        """For a BRDF without shifts."""
        hemispheres = Hemispheres.of(VIEWS)
        return cls(
            hemispheres, ShiftableBRDF.of(brdf, ComponentLookup.of(brdf.basis, hemispheres.angles))
        )

    def at(self, shifts: Array) -> Array:
        """(views, 3) ∫ρ cos θi dωi with these shifts (3, m)."""
        return self.hemispheres.albedo(self.movable.at(shifts))


def excess(albedo: Array) -> tuple[float, float] | None:
    """(the largest albedo, its angle of view in radians) where an albedo of MovableAlbedo exceeds
    1; else None."""
    towards = albedo.max(axis=-1)
    worst = int(np.argmax(towards))
    return (float(towards[worst]), VIEWS[worst]) if towards[worst] > 1 + ALBEDO_TOLERANCE else None


def beyond_measured(brdf: PrincipalBRDF, shifts: Array) -> list[int]:
    """The components (0, 1, …) that the shifts (3, n) move out of the range of the training set;
    empty where that is unknown."""
    training = brdf.basis.training
    if training is None:
        return []
    coefficients, count = shifted(brdf, shifts).coefficients, shifts.shape[1]
    low, high = training.min(axis=0), training.max(axis=0)
    out = (coefficients < low[: coefficients.shape[1]]) | (
        coefficients > high[: coefficients.shape[1]]
    )
    return [i for i in range(min(count, out.shape[1])) if np.any(out[:, i] & (shifts[:, i] != 0))]
