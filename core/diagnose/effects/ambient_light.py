"""Ambient light: light reached the object from all directions, not only from the lamp."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ..forward.diagnosis_context import DiagnosisContext
from ..forward.material_brdfs import MaterialBRDFs
from ..forward.shading_state import ShadingState
from ..forward.surroundings import ACCURACY
from .base.capabilities import BuiltFromBRDFs
from .base.effect import Array
from .base.image_formation import AddsRadiance
from .base.parameters import Parameters


@dataclass(frozen=True)
class AmbientLight(AddsRadiance, BuiltFromBRDFs):
    """Parameters: radiance of the room divided by (irradiance of the lamp / π), for red, green and
    blue. reflected: (n, 3) light that the surface reflects if that ratio is 1, where the object
    itself does not block the room."""

    reflected: Array
    cause = "ambient_light"
    systematic_error = ACCURACY
    deciding_photo = "one photo with the lamp off"

    @classmethod
    def of(cls, context: DiagnosisContext) -> AmbientLight:
        around = context.surroundings
        level = context.pixel_level / np.pi
        return cls(level * around.reflected_light(around.open.astype(np.float32)))

    @property
    def parameters(self) -> Parameters:
        return Parameters.alike(["red", "green", "blue"], "of E/π", 0.1, 0.0, 2.0)

    def added_radiance(self, state: ShadingState, brdfs: MaterialBRDFs, x: np.ndarray) -> Array:
        return self.reflected * x

    def sentence(self, x: np.ndarray, error: np.ndarray) -> str:
        return (
            "Ambient light reaches the object from all directions: "
            f"{100 * float(np.mean(x)):.1f} % of the light of the lamp on a surface that faces it."
        )
