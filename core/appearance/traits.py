"""An artist's change to a measured BRDF: some of its coefficients moved, the rest as measured.

A shift counts in deviations of the training coefficients (sqrt(1/columns), the same for every
component), so 1 is as far as the materials of the training set lie apart. ln(ρ·cosMap + ε) is
linear in the coefficients: at directions that are always the same (a sphere's, a hemisphere's),
the components are looked up once, and a shift costs a product with a thin matrix.
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

VIEWS = tuple(np.radians((0.0, 30.0, 50.0, 65.0, 75.0, 82.0, 87.0)))  # of which the albedo is told
SHOWN = 0.01  # what an albedo may exceed 1 by, unsaid: the quadrature's own error


def deviation(basis: Basis) -> float:
    """What a shift of 1 adds to a coefficient."""
    return float(np.sqrt(basis.coefficient_variance))


def moved(brdf: PrincipalBRDF, shifts: Array) -> PrincipalBRDF:
    """The BRDF with shifts (3, n) of R, G, B added to its first n components, in deviations.
    Without any it is the one that was given."""
    if not np.any(shifts):
        return brdf
    coefficients = np.array(brdf.coefficients, np.float64)
    count = min(shifts.shape[1], coefficients.shape[1])
    coefficients[:, :count] += deviation(brdf.basis) * np.asarray(shifts, np.float64)[:, :count]
    return PrincipalBRDF(brdf.basis, coefficients)


@dataclass(frozen=True)
class Looked:
    """The first components at n directions: what no material and no shift changes.

    slopes: (n, traits) what a shift of 1 adds to ln(ρ·cosMap + ε); weight: (n,) cosMap.
    """

    angles: Angles
    slopes: NDArray[np.float32]
    weight: Array

    @classmethod
    def of(cls, basis: Basis, angles: Angles) -> Looked:
        """At directions (n,)."""
        _, rows = basis.rows(angles, traits(basis.count))
        step = np.float32(deviation(basis))
        return cls(angles, np.ascontiguousarray(step * rows), mapping.cos_map(angles))


@dataclass(frozen=True)
class Movable:
    """A BRDF at those directions, to be moved. logs: (n, 3) ln(ρ·cosMap + ε) as measured."""

    looked: Looked
    logs: NDArray[np.float32]

    @classmethod
    def of(cls, brdf: PrincipalBRDF, looked: Looked) -> Movable:
        """Of the unmoved BRDF."""
        return cls(looked, brdf.log_table.logs(looked.angles))

    def at(self, shifts: Array) -> Array:
        """ρ (n, 3) in 1/sr with shifts (3, m), m at most the components looked up; without any,
        to the bit what the BRDF itself says."""
        slopes = self.looked.slopes[:, : shifts.shape[1]]
        logs = (
            self.logs + slopes @ np.asarray(shifts, np.float32).T if np.any(shifts) else self.logs
        )
        return mapping.unlog_weighted(logs, self.looked.weight).astype(np.float32)


@dataclass(frozen=True)
class MovableAlbedo:
    """How much of the light a BRDF gives back towards each of VIEWS, to be moved."""

    hemispheres: Hemispheres
    movable: Movable

    @classmethod
    def of(cls, brdf: PrincipalBRDF) -> MovableAlbedo:
        """Of the unmoved BRDF."""
        hemispheres = Hemispheres.of(VIEWS)
        return cls(hemispheres, Movable.of(brdf, Looked.of(brdf.basis, hemispheres.angles)))

    def at(self, shifts: Array) -> Array:
        """(views, 3) ∫ρ cos θi dωi with these shifts (3, m)."""
        return self.hemispheres.albedo(self.movable.at(shifts))


def excess(albedo: Array) -> tuple[float, float] | None:
    """(the largest albedo, radians of its view from the normal) where one of MovableAlbedo's
    exceeds 1; None where none does."""
    towards = albedo.max(axis=-1)
    worst = int(np.argmax(towards))
    return (float(towards[worst]), VIEWS[worst]) if towards[worst] > 1 + SHOWN else None


def beyond_measured(brdf: PrincipalBRDF, shifts: Array) -> list[int]:
    """The components (0, 1, …) that the shifts (3, n) move out of the range that any material of
    the training set has; empty where that is not known."""
    training = brdf.basis.training
    if training is None:
        return []
    coefficients, count = moved(brdf, shifts).coefficients, shifts.shape[1]
    low, high = training.min(axis=0), training.max(axis=0)
    out = (coefficients < low[: coefficients.shape[1]]) | (
        coefficients > high[: coefficients.shape[1]]
    )
    return [i for i in range(min(count, out.shape[1])) if np.any(out[:, i] & (shifts[:, i] != 0))]
