"""The brightness of a material relative to the basis.

The paper maps ρ to ln(ρ·cosMap + ε). The offset ε is the same for all materials, so a material that
is half as bright is not a mixture of the same components, and the residual looks as if all photos
were too bright, or as if their values were not linear. A factor of each material's reflectance is
therefore always in the model: it is the same as an offset of the material's own.

The factor is bounded. A large offset lets the BRDF be 0 in many directions, and so imitate light
that does not reach the surface: with a factor of e^3.7, the bronze of ../shared/data had no more
evidence of its displaced flash, and steps of the joint fit increased its cost.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from ..effects.base.image_formation import ChangesShading
from ..effects.base.parameters import Parameters
from ..forward.diagnosis_context import DiagnosisContext, NearestPixels
from ..forward.shading_state import ShadingState

PRIOR_SCALE = 1.0  # of ln factor, standard deviation of the prior: MERL's materials span e³
MAX_LOG = 1.5  # bound of ln factor: half of what MERL's materials span


@dataclass(frozen=True)
class MaterialScale(ChangesShading):
    """Parameters: ln of the factor of each material's reflectance. material: (n,) of each pixel.
    Within a fit it multiplies the light, which is the same; afterwards it belongs to the BRDFs
    (solver/scaled_brdfs.py)."""

    material: NDArray[np.integer]
    cause = "material_scale"
    deciding_photo = ""

    @classmethod
    def of(cls, context: DiagnosisContext) -> MaterialScale:
        return cls(context.pixels.material)

    def at_pixels(self, context: DiagnosisContext, nearest: NearestPixels) -> None:
        """None: the BRDFs have the factor (solver/scaled_brdfs.py)."""
        return

    @property
    def parameters(self) -> Parameters:
        names = [f"material {k + 1}" for k in range(int(self.material.max(initial=0)) + 1)]
        return Parameters.alike(names, "ln", PRIOR_SCALE, -MAX_LOG, MAX_LOG)

    @property
    def parameter_index(self) -> NDArray[np.intp]:
        return self.material[:, None].astype(np.intp)

    def shading(self, state: ShadingState, x: np.ndarray) -> ShadingState:
        factor = np.exp(x)[self.material].astype(np.float32)
        return replace(state, irradiance=state.irradiance * factor[:, None])

    def sentence(self, x: np.ndarray, error: np.ndarray) -> str:
        return ""
