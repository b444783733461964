"""Predicted radiance with the direct light of the lamp only, without any effect."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from .material_brdfs import MaterialBRDFs
from .pixel_footprint import Footprint
from .pixels import Pixels
from .shading_state import ShadingState


def direct_radiance(pixels: Pixels, brdfs: MaterialBRDFs) -> NDArray[np.floating]:
    """(n, 3) radiance under a point lamp, the mean over each pixel's footprint."""
    state = ShadingState.of(pixels)
    radiance = brdfs.reflected(state)
    footprint = Footprint(pixels)
    radiance[footprint.wide] = footprint.mean(state, brdfs.reflected)
    return radiance
