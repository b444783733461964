"""What decides whether a pixel of a lit photo becomes a sample."""

from __future__ import annotations

from enum import IntEnum

import numpy as np
from numpy.typing import NDArray


class Criterion(IntEnum):
    """Of several that speak against a pixel the lowest decides; the highest are those that nothing
    speaks against.

    NO_SURFACE: no mesh behind the pixel; NO_MATERIAL: no mask and no face says what it is;
    SHADOW_MASK, HIGHLIGHT_MASK, IGNORE_MASK: painted as left out; TURNED_AWAY: the surface faces
    away from its light; CAST_SHADOW: something of the mesh stands between; SHADOW_EDGE, OUTLINE,
    GRAZING, MASK_BORDER: within the Margins; UNUSABLE: clipped, or in none of a bracket's
    exposures; MISSED: the light all but misses it (beside a narrow beam); CURVED: more curved than
    the paper's method believes; RELIABLE: a sample.
    """

    NO_SURFACE = 0
    NO_MATERIAL = 1
    SHADOW_MASK = 2
    HIGHLIGHT_MASK = 3
    IGNORE_MASK = 4
    TURNED_AWAY = 5
    CAST_SHADOW = 6
    SHADOW_EDGE = 7
    OUTLINE = 8
    GRAZING = 9
    MASK_BORDER = 10
    UNUSABLE = 11
    MISSED = 12
    CURVED = 13
    RELIABLE = 14


def against(criterion: Criterion, pixels: NDArray[np.bool_]) -> NDArray[np.uint8]:
    """The criterion at ``pixels``, RELIABLE elsewhere: the least of several such decides. (A
    product, since choosing between two numbers takes ten times as long.)"""
    return np.uint8(Criterion.RELIABLE) - pixels.view(np.uint8) * np.uint8(
        Criterion.RELIABLE - criterion
    )
