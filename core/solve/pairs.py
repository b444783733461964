"""Choose the pairs of photos to match."""

from __future__ import annotations

from collections.abc import Callable, Sequence

import numpy as np
from numpy.typing import NDArray

from .features import match

EXHAUSTIVE = 60  # photos, up to which all pairs are matched (1,770 pairs)
LARGEST_FEATURES = 256  # of each photo, for the preselection
NEIGHBOURS = 5  # before and after in the order of names, which is usually the order of capture
PARTNERS = 30  # per photo, those with most preselection matches


def choose_pairs(
    descriptors: Sequence[NDArray[np.uint8]], report: Callable[[float], None] = lambda done: None
) -> list[tuple[int, int]]:
    """Pairs (i < j) of photos to match in full.

    descriptors: (n, 128) of each photo, by decreasing size of the feature. Up to EXHAUSTIVE photos:
    all pairs. For more: neighbours in the order of names, and for each photo the PARTNERS whose
    largest features match best (Wu 2013, "Towards linear-time incremental structure from motion",
    preemptive matching). This needs no vocabulary, and the cost of full matching grows linearly
    with the number of photos. report: called with the fraction done.
    """
    count = len(descriptors)
    if count <= EXHAUSTIVE:
        return [(i, j) for i in range(count) for j in range(i + 1, count)]
    largest = [d[:LARGEST_FEATURES] for d in descriptors]
    votes = np.zeros((count, count), np.int32)
    for i in range(count):
        report(i / count)
        for j in range(i + 1, count):
            votes[i, j] = votes[j, i] = len(match(largest[i], largest[j]))
    selected = {(i, j) for i in range(count) for j in range(i + 1, min(count, i + 1 + NEIGHBOURS))}
    for i in range(count):
        best = np.argsort(-votes[i], kind="stable")[:PARTNERS]
        selected |= {(min(i, int(j)), max(i, int(j))) for j in best if votes[i, j] > 0 and j != i}
    return sorted(selected)
