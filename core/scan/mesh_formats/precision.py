"""What 32-bit coordinates have lost far from the origin."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

TOLERABLE = 1e-4  # of the object's size


def float32_note(stored: NDArray[np.floating]) -> tuple[str, ...]:
    """A sentence where rounding to float32 has moved vertices (v, 3) by more than TOLERABLE of the
    size of what they span; none elsewhere. ``stored``: as they stand in the file."""
    finite = stored[np.isfinite(stored).all(axis=1)].astype(np.float64)
    if not len(finite):
        return ()
    low, high = finite.min(axis=0), finite.max(axis=0)
    size = float(np.linalg.norm(high - low))
    furthest = float(np.maximum(np.abs(low), np.abs(high)).max())
    rounding = furthest * 2.0**-24  # half of a unit in the last place
    if size == 0 or rounding <= TOLERABLE * size:
        return ()
    return (
        f"its coordinates reach {furthest:.3g} and are stored in 32 bits, which rounds them by "
        f"up to {rounding:.2g}, {100 * rounding / size:.2g} % of the object's size: export it "
        "relative to a local origin, or as OBJ or double-precision PLY",
    )
