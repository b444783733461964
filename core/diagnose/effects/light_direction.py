"""Errors of the light directions: each is off by two angles."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from ...angles.vectors import tangents
from ..forward.diagnosis_context import DiagnosisContext, NearestPixels
from ..forward.shading_state import ShadingState
from .base.capabilities import DisplacesLamp
from .base.displaced_shadows import DisplacedShadows
from .base.effect import Array
from .base.image_formation import ChangesShading
from .base.parameters import Parameters, parameter_columns

PRIOR_SCALE = np.radians(3.0)  # standard deviation of the prior
MAX_TILT = np.radians(25.0)  # bound of either angle


@dataclass(frozen=True)
class LightDirection(ChangesShading, DisplacesLamp):
    """Parameters: for each distant light the tangents of two angles, towards ``aside`` and
    ``other``, (lights, 3) unit vectors perpendicular to its direction. light: (n,) number of each
    pixel's light, −1 where it is not distant. shadows: traced for the directions that were
    found."""

    names: tuple[str, ...]
    aside: Array
    other: Array
    light: NDArray[np.intp]
    shadows: DisplacedShadows | None = None
    cause = "light_direction"
    deciding_photo = "a mirror ball next to the object in one photo under each light"
    # facets of the mesh under grazing light, and displaced shadows
    systematic_error = 0.02

    @classmethod
    def of(cls, context: DiagnosisContext) -> LightDirection | None:
        pixels = context.pixels
        wanted = [k for k in range(len(context.lights)) if context.distant[k]]
        number = context.light[pixels.photo]
        wanted = [k for k in wanted if (number == k).any()]
        if not wanted:
            return None
        directions, place = np.empty((len(wanted), 3)), np.full(len(pixels), -1)
        for i, k in enumerate(wanted):
            place[number == k] = i
            directions[i] = pixels.light[np.flatnonzero(number == k)[0]]
        names = tuple(context.lights[k] for k in wanted)
        return cls(names, *tangents(directions), place)

    def at_pixels(self, context: DiagnosisContext, nearest: NearestPixels) -> LightDirection:
        found = replace(self, light=self.light[nearest.photo], shadows=None)
        return found if self.shadows is None else found.with_rays(context, self.shadows.x)

    @property
    def parameters(self) -> Parameters:
        names = [f"{name}, {way}" for name in self.names for way in ("first", "second")]
        return Parameters.alike(names, "rad", PRIOR_SCALE, -MAX_TILT, MAX_TILT)

    @property
    def parameter_index(self) -> NDArray[np.intp]:
        return parameter_columns(self.light, 2)

    def with_rays(self, context: DiagnosisContext, x: np.ndarray) -> LightDirection:
        return replace(self, shadows=DisplacedShadows.of(context, replace(self, shadows=None), x))

    def shading(self, state: ShadingState, x: np.ndarray) -> ShadingState:
        state = state if self.shadows is None else self.shadows.on(state)
        moved = x[0::2, None] * self.aside + x[1::2, None] * self.other
        light = state.light + np.where(self.light[:, None] >= 0, moved[self.light], 0.0)
        light /= np.linalg.norm(light, axis=1, keepdims=True)
        return replace(state, light=light.astype(np.float32))

    def sentence(self, x: np.ndarray, error: np.ndarray) -> str:
        angle = np.degrees(np.arctan(np.hypot(x[0::2], x[1::2])))
        errors = ", ".join(f"{n} by {a:.1f}°" for n, a in zip(self.names, angle, strict=True))
        return f"Light directions are off: {errors}."
