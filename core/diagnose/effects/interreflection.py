"""Interreflection: light reflected from one part of the object onto another."""

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
    """Parameter: the interreflected light divided by the light predicted with the fitted
    materials. reflected: (n, 3) that predicted light; radiosity: photo → (f, 3) radiance that
    every face of the mesh emits after all bounces."""

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
        most = float(np.percentile(x[0] * self.reflected.mean(axis=1), 99))
        return (
            "Light is reflected from one part of the object onto another, so folds are brighter "
            f"than under the lamp alone: {x[0]:.1f} times the interreflection predicted with the "
            f"fitted materials, a radiance of up to {most:.2g}."
        )


def _bounced(context: DiagnosisContext, radiosity: Mapping[int, Array]) -> Array:
    """(n, 3) light that each pixel's surface reflects of the radiosity of the faces it sees."""
    around, pixels = context.surroundings, context.pixels
    reflected = np.zeros((len(pixels), 3), np.float32)
    for photo in np.unique(pixels.photo):
        rows = np.flatnonzero(pixels.photo == photo)
        face = around.face[rows]
        seen = np.where((face >= 0)[..., None], radiosity[int(photo)][np.maximum(face, 0)], 0)
        reflected[rows] = np.einsum("ndc,ndc->nc", around.reflected[rows], seen)
    return reflected
