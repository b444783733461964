"""A whole photo as the model sees it: every material in its place, direct light, shadows."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from ..angles import half_difference
from ..basis import PrincipalBRDF
from ..geometry import RayScene, SurfaceView
from ..light import Light
from ..samples.take import light_surface
from ..scan import Camera


@dataclass(frozen=True)
class PredictedPhoto:
    """radiance: (h, w, 3), 0 in shadow, NaN where no material was fitted or no surface is seen."""

    radiance: NDArray[np.float32]

    @property
    def known(self) -> NDArray[np.bool_]:
        """(h, w) where there is a prediction."""
        return np.isfinite(self.radiance[..., 0])


def predict_photo(
    rays: RayScene,
    view: SurfaceView,
    light: Light,
    camera: Camera,
    parts: list[tuple[NDArray[np.bool_], PrincipalBRDF, float]],
) -> PredictedPhoto:
    """parts: ((n,) pixels of the view, BRDF, its scale) of every material; the scale is what the
    BRDF is too large by where the irradiance is unknown."""
    lighting = light_surface(rays, view, light, camera)
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
    return PredictedPhoto(view.image(values))
