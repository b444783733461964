"""Patches: small parts of the surface, each visible in several photos."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from ...forward.diagnosis_context import DiagnosisContext

ACROSS = 24  # patches over the object's size
MIN_PIXELS = 12  # of a patch; smaller ones are ignored


def surface_patches(context: DiagnosisContext, across: int = ACROSS) -> NDArray[np.intp]:
    """(n,) number of each pixel's patch, −1 where a patch has fewer than MIN_PIXELS pixels. Patches
    are cubes of space, with the two sides of a thin wall separated. across: cubes over the object's
    size."""
    pixels = context.pixels
    place = np.floor((pixels.point - context.centre) / (context.size / across)).astype(np.int64)
    axis = np.abs(pixels.normal).argmax(axis=1)
    side = np.take_along_axis(pixels.normal, axis[:, None], axis=1)[:, 0] > 0
    place -= place.min(axis=0)
    wide = place.max(axis=0) + 1
    key = ((place[:, 0] * wide[1] + place[:, 1]) * wide[2] + place[:, 2]) * 2 + side
    _, of, count = np.unique(key, return_inverse=True, return_counts=True)
    of = of.ravel()
    number = np.where(count >= MIN_PIXELS, np.cumsum(count >= MIN_PIXELS) - 1, -1)
    return np.asarray(number[of], np.intp)


def mean_of(patch: NDArray[np.intp], values: NDArray[np.floating]) -> NDArray[np.float64]:
    """(p, k) means of values (n, k) in each patch; patch: (n,) of each pixel, −1 none."""
    known = np.flatnonzero(patch >= 0)
    count = np.bincount(patch[known])
    sums = [np.bincount(patch[known], column) for column in values[known].T]
    return np.asarray(np.stack(sums, axis=1) / count[:, None], np.float64)


def median_of(patch: NDArray[np.intp], values: NDArray[np.floating]) -> NDArray[np.float64]:
    """(p,) median of values (n,) in each patch; patch: (n,) of each pixel, −1 none."""
    known = np.flatnonzero(patch >= 0)
    order = known[np.lexsort((values[known], patch[known]))]
    count = np.bincount(patch[known])
    middle = np.cumsum(count) - count + count // 2
    return np.asarray(values[order[np.minimum(middle, len(order) - 1)]], np.float64)
