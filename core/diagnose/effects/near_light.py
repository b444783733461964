"""A near lamp: its direction and irradiance vary over the object."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from ..forward.diagnosis_context import DiagnosisContext, NearestPixels
from ..forward.shading_state import ShadingState
from .base.capabilities import DisplacesLamp
from .base.displaced_shadows import DisplacedShadows
from .base.effect import Array
from .base.image_formation import ChangesShading
from .base.parameters import Parameters, mean_removal, parameter_columns
from .light_direction import LightDirection

NEARNESS_SCALE = 0.3  # size of the object / distance, standard deviation of the prior
MIN_DISTANCE = 1.2  # of the lamp from the centre, in sizes: it is not inside the object
# radians and ln gain, of the prior: the light may have been measured away from the centre
ANGLE_SCALE, GAIN_SCALE = np.radians(1.0), 0.05
MAX_DEVIATIONS = 3.0  # of these priors, beyond what the object's size explains
MIN_NEARNESS = 0.03  # below it, the light varies by less than 6 % over the object
EACH = 4  # parameters of a light
START = 0.15  # of the nearness: away from its bound 0, where steps would be cut short


@dataclass(frozen=True)
class NearLight(ChangesShading, DisplacesLamp):
    """Parameters: for each distant light the size of the object divided by the distance of the
    lamp, two angles, and ln of a gain. The angles and the gain are there because direction and
    irradiance of a near lamp may have been measured at another place than the object's centre.
    from_afar: the same lights as distant ones; offset: (n, 3) from the centre, in sizes of the
    object. shadows: traced for the lamp positions that were found."""

    from_afar: LightDirection
    offset: Array
    size: float
    shadows: DisplacedShadows | None = None
    cause = "near_light"
    deciding_photo = "the same photos with the lamp twice as far away"

    @classmethod
    def of(cls, context: DiagnosisContext) -> NearLight | None:
        from_afar = LightDirection.of(context)
        if from_afar is None:
            return None
        return cls(from_afar, _offset(context), context.size)

    def at_pixels(self, context: DiagnosisContext, nearest: NearestPixels) -> NearLight:
        from_afar = self.from_afar.at_pixels(context, nearest)
        found = replace(self, from_afar=from_afar, offset=_offset(context), shadows=None)
        return found if self.shadows is None else found.with_rays(context, self.shadows.x)

    @property
    def parameters(self) -> Parameters:
        names, units = [], []
        for light in self.from_afar.names:
            names += [f"{light}, {what}" for what in ("nearness", "first", "second", "gain")]
            units += ["size / distance", "rad", "rad", "ln"]
        count = len(self.from_afar.names)
        return Parameters(
            tuple(names), tuple(units),
            np.tile([NEARNESS_SCALE, ANGLE_SCALE, ANGLE_SCALE, GAIN_SCALE], count),
            np.tile([0.0, -0.2, -0.2, -0.5], count),
            np.tile([1 / MIN_DISTANCE, 0.2, 0.2, 0.5], count),
            np.full(EACH * count, 1e-3),
            np.tile([START, 0.0, 0.0, 0.0], count),
        )  # fmt: skip

    @property
    def parameter_index(self) -> NDArray[np.intp]:
        return parameter_columns(self.from_afar.light, EACH)

    @property
    def identifiable(self) -> NDArray[np.float64]:
        return mean_removal(len(self.from_afar.names), EACH, EACH - 1)

    def nearness(self, x: NDArray[np.float64]) -> NDArray[np.float64]:
        """(lights,) size of the object divided by the distance of the lamp."""
        return x[::EACH]

    def is_relevant(self, x: np.ndarray) -> bool:
        return float(self.nearness(x).max()) > MIN_NEARNESS and self._is_possible(x)

    def _is_possible(self, x: NDArray[np.float64]) -> bool:
        """Whether a lamp that is so near can have been measured with these directions and gains
        anywhere on the object. If not, the parameters imitate something else."""
        across = np.minimum(self.nearness(x) / 2, 0.9)  # half a size / distance
        angle = np.arcsin(across) + MAX_DEVIATIONS * ANGLE_SCALE
        gain = -2 * np.log(1 - across) + MAX_DEVIATIONS * GAIN_SCALE
        found = np.hypot(x[1::EACH], x[2::EACH])
        return bool(np.all(found < angle) and np.all(np.abs(x[3::EACH]) < gain))

    def with_rays(self, context: DiagnosisContext, x: np.ndarray) -> NearLight:
        return replace(self, shadows=DisplacedShadows.of(context, replace(self, shadows=None), x))

    def shading(self, state: ShadingState, x: np.ndarray) -> ShadingState:
        state = state if self.shadows is None else self.shadows.on(state)
        angles = np.stack([x[1::EACH], x[2::EACH]], axis=1).ravel()
        state = self.from_afar.shading(state, angles)
        light = self.from_afar.light
        # a lamp at light / nearness, in sizes: direction from a point: light − nearness · offset
        inverse = np.where(light >= 0, x[::EACH][light], 0.0).astype(np.float32)
        gain = np.where(light >= 0, np.exp(x[3::EACH])[light], 1.0).astype(np.float32)
        towards = state.light - inverse[:, None] * self.offset
        length = np.linalg.norm(towards, axis=1, keepdims=True)
        irradiance = state.irradiance * gain[:, None] / length**2
        return replace(state, light=towards / length, irradiance=irradiance)

    def sentence(self, x: np.ndarray, error: np.ndarray) -> str:
        nearness = np.maximum(self.nearness(x), 1e-9)
        order = np.argsort(-nearness)
        near = [k for k in order if nearness[k] > MIN_NEARNESS] or [int(order[0])]
        half = min(float(nearness[near[0]]) / 2, 0.9)
        unevenness = 100 * (((1 + half) / (1 - half)) ** 2 - 1)
        distances = ", ".join(
            f"{self.from_afar.names[k]!r} {self.size / nearness[k]:.3g}" for k in near
        )
        if len(near) == 1:
            start = (
                f"The lamp {self.from_afar.names[near[0]]!r} is near the object: its distance is "
                f"about {self.size / nearness[near[0]]:.3g} scan units "
                f"({1 / nearness[near[0]]:.1f} times the size of the object)"
            )
        else:
            start = (
                f"{len(near)} lamps are near the object. Their distances are about {distances} "
                f"scan units (the object's size is {self.size:.3g})"
            )
        return (
            f"{start}; the near side of the object gets up to {unevenness:.0f} % more light than "
            "the far side."
        )


def _offset(context: DiagnosisContext) -> Array:
    """(n, 3) position relative to the centre, in sizes of the object."""
    return ((context.pixels.point - context.centre) / context.size).astype(np.float32)
