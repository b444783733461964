"""The precision that 32-bit coordinates lose far from the origin."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

MAX_RELATIVE_ROUNDING = 1e-4  # fraction of the object's size


def float32_note(stored: NDArray[np.floating]) -> tuple[str, ...]:
    """A note where rounding to float32 moved vertices (v, 3) by more than MAX_RELATIVE_ROUNDING of
    the size of their bounding box; () otherwise. ``stored``: coordinates as in the file."""
    finite = stored[np.isfinite(stored).all(axis=1)].astype(np.float64)
    if not len(finite):
        return ()
    low, high = finite.min(axis=0), finite.max(axis=0)
    size = float(np.linalg.norm(high - low))
    furthest = float(np.maximum(np.abs(low), np.abs(high)).max())
    rounding = furthest * 2.0**-24  # half of a unit in the last place
    if size == 0 or rounding <= MAX_RELATIVE_ROUNDING * size:
        return ()
    return (
        f"The coordinates of the mesh reach {furthest:.3g} and are stored in 32 bits, which rounds "
        f"them by up to {rounding:.2g} ({100 * rounding / size:.2g} % of the object's size). "
        "Export "
        "the mesh relative to a local origin, or as OBJ or double-precision PLY.",
    )
