"""What a fit does not know about a material, reduced so that the gain of a photo follows fast."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from ..angles import Angles, cosines
from ..basis import Basis, mapping
from ..fit.measured.cell_weights import CELLS_PER_REGION
from ..fit.measured_result import MeasuredResult
from ..fit.spread import MAX_THETA, directions
from ..noise.basis_error import basis_variance
from . import regions

Array = NDArray[np.float64]

KEPT = 30  # uncertain combinations of coefficients; the others are known
MARGIN = np.radians(4.0)  # half a region: its middle may be so far beyond MAX_THETA
MIN_POINTS = 2  # of the drawn surface points that a part of a region needs to count as photographed


@dataclass(frozen=True)
class DirectionUncertainty:
    """The uncertainty of one material after a fit.

    root: (parts, KEPT) for each part of a region of angle space (regions.py) the change of
    ln(ρ·cosMap + ε) with each of the uncertain combinations of coefficients, whose posterior
    variance is 1, divided by the standard deviation of one cell. target: (KEPT, KEPT) the mean over
    the hemisphere of the products of the changes. rest: mean variance by the combinations that are
    not kept. weight: (regions,) observations that each region has already.
    """

    root: Array
    target: Array
    rest: float
    weight: Array

    @classmethod
    def of(cls, fit: MeasuredResult) -> DirectionUncertainty:
        """From the posterior of a fit; the mean of the three channels."""
        basis = fit.brdf.basis
        covariance = fit.covariance
        angles = directions(basis.grid)
        _, rows = basis.rows(angles, len(covariance))
        q = rows.astype(np.float64)
        factor = np.linalg.cholesky(covariance + 1e-12 * np.eye(len(covariance)))
        changes = q @ factor  # of ln(ρ·cosMap + ε) with coefficients of variance 1
        mean = changes.T @ changes / len(changes)
        size, axes = np.linalg.eigh(mean)
        kept = axes[:, ::-1][:, :KEPT]
        centres = regions.centres()
        return cls(
            root=_per_cell(fit, basis, centres) * (_rows(basis, centres, factor) @ kept),
            target=kept.T @ mean @ kept,
            rest=float(size[::-1][KEPT:].sum()),
            weight=np.minimum(fit.cells_per_region, CELLS_PER_REGION),
        )

    def deviation(self) -> float:
        """RMS over the angle grid of the standard deviation of ln(ρ·cosMap + ε), now."""
        return float(np.sqrt(np.trace(self.target) + self.rest))

    def variance_after(self, points: NDArray[np.integer]) -> Array:
        """(photos,) the mean variance over the hemisphere that is expected after one more photo.

        points: (photos, parts) how many of the drawn surface points a photo shows in each part of a
        region. A region gains up to CELLS_PER_REGION observations, less what it has already.
        """
        shown = points >= MIN_POINTS
        region = regions.region_of_part()
        starts = np.flatnonzero(np.diff(region, prepend=-1))
        parts = np.add.reduceat(shown, starts, axis=1)
        gained = np.where(parts > 0, CELLS_PER_REGION - self.weight, 0.0)
        each = (gained / np.maximum(parts, 1))[:, region] * shown
        products = np.einsum("pi,pj->pij", self.root, self.root).reshape(len(self.root), -1)
        k = len(self.target)
        precision = np.eye(k) + (each @ products).reshape(-1, k, k)
        found = np.linalg.solve(precision, np.broadcast_to(self.target, precision.shape))
        return np.trace(found, axis1=1, axis2=2) + self.rest


def _rows(basis: Basis, angles: Angles, factor: Array) -> Array:
    """(n, k) change of ln(ρ·cosMap + ε) with coefficients of variance 1."""
    return np.asarray(basis.rows(angles, len(factor))[1].astype(np.float64) @ factor)


def _per_cell(fit: MeasuredResult, basis: Basis, angles: Angles) -> Array:
    """(n, 1) one over the standard deviation of ln(ρ·cosMap + ε) of a cell; 0 for directions below
    the horizon, which no photo has."""
    weight = mapping.cos_map(angles)
    level = fit.brdf.evaluate(angles).mean(axis=1) * weight + mapping.EPSILON
    above = np.min(cosines(*angles), axis=0) > np.cos(MAX_THETA + MARGIN)
    return np.asarray(above / np.sqrt(basis_variance(level)))[:, None]
