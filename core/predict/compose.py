"""Predict a whole photo: all materials, direct light, shadows."""

from __future__ import annotations

from collections.abc import Iterable

import numpy as np
from numpy.typing import NDArray

from ..angles import half_difference
from ..basis import PrincipalBRDF
from ..geometry import SurfaceView
from ..samples.take import Lighting


def predict_photo(
    view: SurfaceView,
    lighting: Lighting,
    parts: Iterable[tuple[NDArray[np.bool_], PrincipalBRDF, float]],
) -> NDArray[np.float32]:
    """(n, 3) radiance of a view's pixels: 0 in shadow, NaN where no material was fitted.

    parts: ((n,) pixels of the view, BRDF, scale) of every material; where the irradiance is unknown
    the BRDF is too large by the factor scale.
    """
    values = np.full((len(view.pixel), 3), np.nan, np.float32)
    for pixels, brdf, scale in parts:
        values[pixels] = 0.0
        lit = pixels & ~lighting.shadowed
        incidence = lighting.incidence.select(lit)
        angles = half_difference(view.normal[lit], incidence.towards, view.view[lit])
        values[lit] = (
            brdf.evaluate(angles)
            * (incidence.irradiance / scale).astype(np.float32)
            * lighting.cos_i[lit, None]
        )
    return values
