"""What measured materials teach about coefficients before a photo is seen.

Coefficients of training columns have variance 1/columns, uncorrelated between components: a
Gaussian process over angle space whose covariance is that of the measured materials. The channels
of one material agree in most of their shape: each component's variance divides into what the three
channels share and what each has of its own.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from ...basis import Basis
from .grazing_prior import Anchors

LEAST_OWN = 0.02  # of the variance, each channel's own: no component is exactly grey


@dataclass(frozen=True)
class ChannelPrior:
    """shared, own: (k,) variances of what the channels share and of what each has beside.
    anchors: what lobes expect where no photo looked, trusted to a log-relative ``trust``."""

    shared: NDArray[np.float64]
    own: NDArray[np.float64]
    anchors: Anchors | None = None
    trust: float = np.inf

    def anchored(self, anchors: Anchors | None, trust: float) -> ChannelPrior:
        """The same prior with anchors; trust infinite: without."""
        return replace(self, anchors=anchors if np.isfinite(trust) else None, trust=trust)

    @classmethod
    def of(cls, basis: Basis, k: int, coupled: bool = True) -> ChannelPrior:
        """Learned from the training coefficients where the basis has them; else, and with
        ``coupled`` False, the channels are independent."""
        total = np.full(k, basis.coefficient_variance)
        if not coupled or basis.training is None:
            return cls(np.zeros(k), total)
        material = basis.training[:, :k].reshape(-1, 3, k)
        own = material.var(axis=1, ddof=1).mean(axis=0) / basis.training[:, :k].var(axis=0)
        own = np.clip(own, LEAST_OWN, 1.0)
        return cls((1 - own) * total, own * total)

    def precision(self) -> NDArray[np.float64]:
        """(3k, 3k), channels one after the other."""
        k = len(self.own)
        # inverse of own·1 + shared·11ᵀ, component by component (Sherman–Morrison)
        off = -self.shared / (self.own * (self.own + 3 * self.shared))
        out = np.zeros((3, k, 3, k))
        diagonal = np.arange(k)
        for a in range(3):
            for b in range(3):
                out[a, diagonal, b, diagonal] = off + (1 / self.own if a == b else 0.0)
            if self.anchors is not None:
                out[a, :, a] += self.anchors.gram / self.trust**2
        return out.reshape(3 * k, 3 * k)

    def pull(self) -> NDArray[np.float64]:
        """(3k,) precision · mean."""
        if self.anchors is None:
            return np.zeros(3 * len(self.own))
        return self.anchors.pull.ravel() / self.trust**2
