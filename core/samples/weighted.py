"""Statistics of all samples, computed from those that were kept."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from .table import SampleTable


def thinned(table: SampleTable) -> bool:
    """Whether rows represent more than one sample."""
    return bool(len(table) and table.weight.max() > 1)


def median(values: NDArray[np.floating], weight: NDArray[np.floating]) -> float:
    """Weighted median of values (n,), n > 0, with weights (n,)."""
    if (weight == weight[0]).all():
        return float(np.median(values))
    order = np.argsort(values, kind="stable")
    below = np.cumsum(weight[order], dtype=np.float64)
    return float(values[order[np.searchsorted(below, 0.5 * below[-1])]])
