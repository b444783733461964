"""Which photos to compare with which."""

from __future__ import annotations

from collections.abc import Callable, Sequence

import numpy as np
from numpy.typing import NDArray

from .features import match

EXHAUSTIVE = 60  # photos: up to here every pair is compared, 1,770 of them
LARGEST_FEATURES = 256  # of each photo, for a first look
NEIGHBOURS = 5  # before and after in the order of names: taken one after the other
PARTNERS = 30  # of each photo, the most promising


def choose_pairs(
    descriptors: Sequence[NDArray[np.uint8]], tell: Callable[[float], None] = lambda done: None
) -> list[tuple[int, int]]:
    """Pairs (i < j) of photos worth comparing in full.

    descriptors: of each photo (n, 128), by falling size of the feature. Up to EXHAUSTIVE photos:
    all pairs. More: neighbours in the order of names, and for each photo the PARTNERS with which
    its largest features alone match best (Wu 2013, "Towards linear-time incremental structure from
    motion", preemptive matching): no vocabulary to download, and the cost of the full comparison
    grows with the number of photos, not with its square.
    """
    count = len(descriptors)
    if count <= EXHAUSTIVE:
        return [(i, j) for i in range(count) for j in range(i + 1, count)]
    few = [d[:LARGEST_FEATURES] for d in descriptors]
    votes = np.zeros((count, count), np.int32)
    for i in range(count):
        tell(i / count)
        for j in range(i + 1, count):
            votes[i, j] = votes[j, i] = len(match(few[i], few[j]))
    chosen = {(i, j) for i in range(count) for j in range(i + 1, min(count, i + 1 + NEIGHBOURS))}
    for i in range(count):
        best = np.argsort(-votes[i], kind="stable")[:PARTNERS]
        chosen |= {(min(i, int(j)), max(i, int(j))) for j in best if votes[i, j] > 0 and j != i}
    return sorted(chosen)
