"""The criteria that decide whether a pixel of a lit photo becomes a sample."""

from __future__ import annotations

from enum import IntEnum

import numpy as np
from numpy.typing import NDArray


class Criterion(IntEnum):
    """The reason why a pixel is rejected. Where several apply, the lowest value decides; RELIABLE,
    the highest, means that none applies.

    NO_SURFACE: no mesh behind the pixel; NO_MATERIAL: neither a mask nor a face assigns a material;
    SHADOW_MASK, HIGHLIGHT_MASK, IGNORE_MASK: excluded by a painted mask; TURNED_AWAY: the surface
    faces away from its light; CAST_SHADOW: the mesh occludes the light; SHADOW_EDGE, OUTLINE,
    GRAZING, MASK_BORDER: within the Margins; UNUSABLE: clipped, or in none of the exposures of a
    bracket; OUTSIDE_BEAM: almost no light arrives, as outside a narrow beam; CURVED: above the
    curvature limit of the paper's method; RELIABLE: a sample.
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
    OUTSIDE_BEAM = 12
    CURVED = 13
    RELIABLE = 14


def criterion_where(criterion: Criterion, pixels: NDArray[np.bool_]) -> NDArray[np.uint8]:
    """(n,) the criterion at ``pixels``, RELIABLE elsewhere: the minimum of several such arrays
    decides. (A product, since np.where takes ten times as long.)"""
    return np.uint8(Criterion.RELIABLE) - pixels.view(np.uint8) * np.uint8(
        Criterion.RELIABLE - criterion
    )
