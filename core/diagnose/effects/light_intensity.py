"""Drift of the lamp, or wrong exposures: every photo has its own gain."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from ..forward.diagnosis_context import DiagnosisContext, NearestPixels
from ..forward.shading_state import ShadingState
from .base.image_formation import ChangesShading
from .base.parameters import Parameters, mean_removal, parameter_columns

PRIOR_SCALE = 0.1  # of ln gain, standard deviation of the prior
# of ln gain: errors of the BRDF that a whole photo has in common, such as those of interpolation in
# the basis (1 %, `run.py bench basis`)
GAIN_ERROR = 0.01
# of the ratio of two gains, its logarithm: a smaller one is not named; two standard errors
MIN_DRIFT = 2 * np.sqrt(2) * GAIN_ERROR


@dataclass(frozen=True)
class LightIntensity(ChangesShading):
    """Parameters: ln of each photo's gain. A common factor belongs to the BRDF; the prior keeps the
    mean at 0. photo: (n,) index of each pixel's photo in ``photos``, which holds their
    numbers. lamp: the number of each photo's light in ``lamps``, which holds their names."""

    photos: tuple[int, ...]
    photo: NDArray[np.intp]
    lamp: tuple[int, ...]
    lamps: tuple[str, ...]
    cause = "light_intensity"
    deciding_photo = "a grey card next to the object in every photo"

    @classmethod
    def of(cls, context: DiagnosisContext) -> LightIntensity | None:
        photos, place = np.unique(context.pixels.photo, return_inverse=True)
        if len(photos) < 2:
            return None
        lamp = tuple(context.light[photos].tolist())
        return cls(tuple(photos.tolist()), place.ravel(), lamp, context.lights)

    def at_pixels(self, context: DiagnosisContext, nearest: NearestPixels) -> LightIntensity:
        return replace(self, photo=self.photo[nearest.photo])

    @property
    def parameters(self) -> Parameters:
        names = [f"photo {p + 1}" for p in self.photos]
        return Parameters.alike(names, "ln", PRIOR_SCALE, -1.5, 1.5)

    @property
    def parameter_index(self) -> NDArray[np.intp]:
        return parameter_columns(self.photo, 1)

    @property
    def identifiable(self) -> NDArray[np.float64]:
        return mean_removal(len(self.photos), 1, 0)

    def shading(self, state: ShadingState, x: np.ndarray) -> ShadingState:
        gain = np.exp(x)[self.photo].astype(np.float32)
        return replace(state, irradiance=state.irradiance * gain[:, None])

    def systematic_errors(self, x: np.ndarray) -> np.ndarray:
        return np.full(len(x), GAIN_ERROR)

    def sentence(self, x: np.ndarray, error: np.ndarray) -> str:
        gain = np.exp(x - x.mean())
        low, high = int(np.argmin(gain)), int(np.argmax(gain))
        drift = self._largest_drift(x)
        if drift is not None and x[high] - x[low] < 2 * np.hypot(error[high], error[low]):
            dim, bright = drift
            return (
                f"The brightness of the lamp '{self.lamps[self.lamp[dim]]}' (or the exposure) "
                f"changed between its photos: photo {self.photos[bright] + 1} is "
                f"{100 * (gain[bright] / gain[dim] - 1):.0f} % brighter than photo "
                f"{self.photos[dim] + 1}."
            )
        return (
            "The brightness of the lamp (or the exposure) differs between photos: from "
            f"{100 * (gain[low] - 1):+.0f} % in photo {self.photos[low] + 1} to "
            f"{100 * (gain[high] - 1):+.0f} % in photo {self.photos[high] + 1}, relative to the "
            "mean."
        )

    def _largest_drift(self, x: np.ndarray) -> tuple[int, int] | None:
        """(the dimmest, the brightest photo) of the lamp whose photos differ most; None below
        MIN_DRIFT. The ratio of such photos does not depend on the lamps' irradiances, which the
        BRDF could absorb."""
        found, largest = None, MIN_DRIFT
        for lamp in set(self.lamp):
            own = np.flatnonzero(np.asarray(self.lamp) == lamp)
            dim, bright = own[np.argmin(x[own])], own[np.argmax(x[own])]
            if x[bright] - x[dim] > largest:
                found, largest = (int(dim), int(bright)), float(x[bright] - x[dim])
        return found
