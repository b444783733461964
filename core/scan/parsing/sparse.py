"""Convert sparse points to arrays without invalid points."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from ..reconstruction import MAX_COORDINATE

Array = NDArray[np.float64]


def sparse_points(
    points: Array, colours: Array | None = None
) -> tuple[Array, NDArray[np.uint8], tuple[str, ...]]:
    """(points (n, 3), colours (n, 3), notes) without points that are not finite or beyond
    MAX_COORDINATE. colours: 0..255, of any type; missing or non-finite colours become grey."""
    with np.errstate(invalid="ignore"):
        good = (np.abs(points) <= MAX_COORDINATE).all(axis=1)
    if colours is None or len(colours) != len(points):
        colours = np.full(points.shape, 128.0)
    bytes_ = np.nan_to_num(np.clip(colours, 0, 255), nan=128.0)[good].round().astype(np.uint8)
    left_out = int((~good).sum())
    notes = (f"Sparse points without a valid position that were left out: {left_out:,}.",) * bool(
        left_out
    )
    return np.ascontiguousarray(points[good], np.float64), bytes_, notes
