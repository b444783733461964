"""Statistics of all samples from those that were kept of them."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from .table import SampleTable


def thinned(table: SampleTable) -> bool:
    """Whether rows stand for more than themselves."""
    return bool(len(table) and table.weight.max() > 1)


def median(values: NDArray[np.floating], weight: NDArray[np.floating]) -> float:
    """Of values (n,), n > 0, each of which counts as ``weight`` (n,)."""
    if (weight == weight[0]).all():
        return float(np.median(values))
    order = np.argsort(values, kind="stable")
    below = np.cumsum(weight[order], dtype=np.float64)
    return float(values[order[np.searchsorted(below, 0.5 * below[-1])]])
