"""Gaussian prior of the coefficients, from all measured materials that the basis knows.

Coefficients of training columns have variance 1/columns and are uncorrelated between components: a
Gaussian process over angle space whose covariance is that of the database. Where the basis knows
other measured materials too (Basis.others), mean and covariance are those of all of them together:
the components stay those of the database, but what is plausible is learnt from everything that was
measured. The channels are independent.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from ...basis import Basis
from .grazing_prior import GrazingPrior

# of each variance is added to it: a covariance of a few hundred columns underestimates the variance
# of sums of components that these columns happen not to have
ADDED_VARIANCE = 0.03


@dataclass(frozen=True)
class CoefficientPrior:
    """mean: (k,) of each channel's coefficients. precision: (k, k) inverse of their covariance.
    variance: (k,) of each coefficient. grazing: pseudo-observations at grazing angles
    (grazing_prior.py), with log-relative standard deviation ``trust``."""

    mean: NDArray[np.float64]
    precision: NDArray[np.float64]
    variance: NDArray[np.float64]
    grazing: GrazingPrior | None = None
    trust: float = np.inf

    def with_grazing_prior(self, grazing: GrazingPrior | None, trust: float) -> CoefficientPrior:
        """The same prior with pseudo-observations; none where trust is infinite."""
        return replace(self, grazing=grazing if np.isfinite(trust) else None, trust=trust)

    @classmethod
    def of(cls, basis: Basis, k: int) -> CoefficientPrior:
        """Prior of the first k coefficients."""
        if basis.training is None or basis.others is None:
            total = np.full(k, basis.coefficient_variance)
            return cls(np.zeros(k), np.diag(1 / total), total)
        known = np.concatenate([basis.training[:, :k], basis.others[:, :k]])
        covariance = np.cov(known.T, bias=True)
        covariance += ADDED_VARIANCE * np.diag(np.diag(covariance))
        return cls(known.mean(axis=0), np.linalg.inv(covariance), np.diag(covariance).copy())

    def scaled(self, scale: float) -> CoefficientPrior:
        """The same prior with its covariance multiplied by ``scale``."""
        return replace(self, precision=self.precision / scale, variance=self.variance * scale)

    def full_precision(self) -> NDArray[np.float64]:
        """(3k, 3k) precision, channel after channel."""
        k = len(self.mean)
        own = self.precision
        if self.grazing is not None:
            own = own + self.grazing.gram / self.trust**2
        out = np.zeros((3, k, 3, k))
        for channel in range(3):
            out[channel, :, channel] = own
        return out.reshape(3 * k, 3 * k)

    def rhs(self) -> NDArray[np.float64]:
        """(3k,) full precision · mean."""
        pull = np.tile(self.precision @ self.mean, 3)
        return pull if self.grazing is None else pull + self.grazing.rhs.ravel() / self.trust**2

    def mean_square(self, coefficients: NDArray[np.floating]) -> float:
        """Mean square of coefficients (3, k) in units of the covariance: 1 on average for a
        material like the measured ones of which all coefficients were known."""
        off = np.asarray(coefficients) - self.mean
        return float(np.mean(np.sum((off @ self.precision) * off, axis=1)) / len(self.mean))
