"""Light bounced from one part of the object to another."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace

import numpy as np

from ..forward.diagnosis_context import DiagnosisContext, NearestPixels
from ..forward.material_brdfs import MaterialBRDFs
from ..forward.shading_state import ShadingState
from ..forward.surroundings import ACCURACY
from .base.capabilities import BuiltFromBRDFs
from .base.effect import Array
from .base.image_formation import AddsRadiance
from .base.parameters import Parameters


@dataclass(frozen=True)
class Interreflection(AddsRadiance, BuiltFromBRDFs):
    """numbers: the bounced light over what the fitted materials bounce. reflected: (n, 3) that
    light; radiosity: by photo, (f, 3) what every face of the mesh sends off."""

    reflected: Array
    radiosity: dict[int, Array]
    cause = "interreflection"
    systematic_error = ACCURACY
    deciding_photo = "one photo with a black cloth over the parts that face the bright ones"

    @classmethod
    def of(cls, context: DiagnosisContext) -> Interreflection | None:
        if not (context.surroundings.face >= 0).any():
            return None
        radiosity = {
            int(photo): context.face_radiosity(int(photo))
            for photo in np.unique(context.pixels.photo)
        }
        return cls(_bounced(context, radiosity), radiosity)

    def at_pixels(self, context: DiagnosisContext, nearest: NearestPixels) -> Interreflection:
        return replace(self, reflected=_bounced(context, self.radiosity))

    @property
    def parameters(self) -> Parameters:
        return Parameters.alike(["bounce"], "of one", 0.7, 0.0, 3.0, step=1e-2)

    def added_radiance(self, state: ShadingState, brdfs: MaterialBRDFs, x: np.ndarray) -> Array:
        return self.reflected * x[0]

    def sentence(self, x: np.ndarray, error: np.ndarray) -> str:
        most = 100 * float(np.percentile(x[0] * self.reflected.mean(axis=1), 99))
        return (
            "light bounced from one part of the object to another: folds are brighter than the "
            f"lamp makes them ({x[0]:.1f} times what the fitted material would bounce; up "
            f"to {most:.2g} in units of 1/100 radiance)"
        )


def _bounced(context: DiagnosisContext, radiosity: Mapping[int, Array]) -> Array:
    """(n, 3) reflected of what the faces that each pixel sees send off, 0 in shadow."""
    around, pixels = context.surroundings, context.pixels
    reflected = np.zeros((len(pixels), 3), np.float32)
    for photo in np.unique(pixels.photo):
        rows = np.flatnonzero(pixels.photo == photo)
        face = around.face[rows]
        seen = np.where((face >= 0)[..., None], radiosity[int(photo)][np.maximum(face, 0)], 0)
        reflected[rows] = np.einsum("ndc,ndc->nc", around.reflected[rows], seen)
    return reflected
