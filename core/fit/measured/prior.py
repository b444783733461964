"""Gaussian prior of the coefficients, from the measured materials of the training set.

Coefficients of training columns have variance 1/columns and are uncorrelated between components: a
Gaussian process over angle space whose covariance is that of the measured materials. The channels
of one material agree in most of their shape: each component's variance is split into a part that
the three channels share and a part of each channel's own.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from ...basis import Basis
from .grazing_prior import GrazingPrior

MIN_OWN_SHARE = 0.02  # of the variance is each channel's own: no component is exactly grey


@dataclass(frozen=True)
class ChannelPrior:
    """shared, own: (k,) variance that the channels share, and that of each channel alone. grazing:
    pseudo-observations at grazing angles (grazing_prior.py), with log-relative standard deviation
    ``trust``."""

    shared: NDArray[np.float64]
    own: NDArray[np.float64]
    grazing: GrazingPrior | None = None
    trust: float = np.inf

    def with_grazing_prior(self, grazing: GrazingPrior | None, trust: float) -> ChannelPrior:
        """The same prior with pseudo-observations; none where trust is infinite."""
        return replace(self, grazing=grazing if np.isfinite(trust) else None, trust=trust)

    @classmethod
    def of(cls, basis: Basis, k: int, coupled: bool = True) -> ChannelPrior:
        """Prior of the first k coefficients. The split between the channels is learned from the
        training coefficients where the basis has them; otherwise, and with ``coupled`` False, the
        channels are independent."""
        total = np.full(k, basis.coefficient_variance)
        if not coupled or basis.training is None:
            return cls(np.zeros(k), total)
        material = basis.training[:, :k].reshape(-1, 3, k)
        own = material.var(axis=1, ddof=1).mean(axis=0) / basis.training[:, :k].var(axis=0)
        own = np.clip(own, MIN_OWN_SHARE, 1.0)
        return cls((1 - own) * total, own * total)

    def precision(self) -> NDArray[np.float64]:
        """(3k, 3k) precision, channel after channel."""
        k = len(self.own)
        # inverse of own·1 + shared·11ᵀ, component by component (Sherman–Morrison)
        off = -self.shared / (self.own * (self.own + 3 * self.shared))
        out = np.zeros((3, k, 3, k))
        diagonal = np.arange(k)
        for a in range(3):
            for b in range(3):
                out[a, diagonal, b, diagonal] = off + (1 / self.own if a == b else 0.0)
            if self.grazing is not None:
                out[a, :, a] += self.grazing.gram / self.trust**2
        return out.reshape(3 * k, 3 * k)

    def rhs(self) -> NDArray[np.float64]:
        """(3k,) precision · mean."""
        if self.grazing is None:
            return np.zeros(3 * len(self.own))
        return self.grazing.rhs.ravel() / self.trust**2
