"""The unknowns of an effect, with their priors and bounds."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray


@dataclass(frozen=True)
class Parameters:
    """All are 0 where the effect is absent. names, units: (p,). deviation: (p,) standard deviation
    of a Gaussian prior about 0. low, high: (p,) bounds. step: (p,) for difference quotients.
    start: (p,) where the search starts; None: at 0."""

    names: tuple[str, ...]
    units: tuple[str, ...]
    deviation: NDArray[np.float64]
    low: NDArray[np.float64]
    high: NDArray[np.float64]
    step: NDArray[np.float64]
    start: NDArray[np.float64] | None = None

    @classmethod
    def alike(
        cls,
        names: Sequence[str],
        unit: str,
        deviation: float,
        low: float = -np.inf,
        high: float = np.inf,
        step: float = 1e-3,
        start: float = 0.0,
    ) -> Parameters:
        """Parameters of one kind."""
        p = len(names)
        return cls(
            tuple(names), (unit,) * p, np.full(p, deviation), np.full(p, low), np.full(p, high),
            np.full(p, step), np.full(p, start),
        )  # fmt: skip

    def __len__(self) -> int:
        return len(self.names)

    @property
    def initial(self) -> NDArray[np.float64]:
        """(p,) where the search starts."""
        return np.zeros(len(self)) if self.start is None else self.start.copy()


def mean_removal(count: int, each: int, place: int) -> NDArray[np.float64]:
    """(count · each,)² projection that removes the mean of the parameters at ``place`` of all
    ``count`` groups of ``each`` parameters."""
    out = np.eye(count * each)
    at = np.arange(count) * each + place
    out[np.ix_(at, at)] -= 1 / count
    return out


def parameter_columns(group: NDArray[np.intp], each: int) -> NDArray[np.intp]:
    """(n, each) indices of the parameters that each pixel depends on, where every photo (light,
    patch) has ``each`` parameters of its own. group: (n,) of each pixel, −1 none."""
    return np.where(group[:, None] >= 0, group[:, None] * each + np.arange(each), -1)
