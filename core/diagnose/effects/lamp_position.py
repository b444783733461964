"""A near lamp that stands elsewhere than the capture states: nearer, farther or to a side."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from ...angles.vectors import tangents
from ..forward.diagnosis_context import DiagnosisContext
from ..forward.shading_state import ShadingState
from .base.displaced_lamp import DisplacedLamp, lamps_of
from .base.parameters import Parameters, mean_removal

NEARNESS_SCALE, SIDE_SCALE, GAIN_SCALE = 0.15, 0.05, 0.05
"""Standard deviations of the prior: of the displacement towards the object and to the sides, in
distances of the lamp, and of ln gain."""
EACH = 4  # parameters of a lamp
WAYS = ("nearer", "first side", "second side")


@dataclass(frozen=True)
class LampPosition(DisplacedLamp):
    """Parameters: for each near lamp its displacement towards the object's centre and to both
    sides, in distances of the lamp from the centre, and ln of a gain. At the centre, a displaced
    lamp is as bright as before: how bright it is was measured there, or belongs to the BRDF.
    centre: (n, 3) from the object's centre to the pixel's lamp."""

    centre: NDArray[np.floating] | None = None
    cause = "near_light"
    deciding_photo = "a photo of everything that stands around the object, with a scale in it"
    systematic_error = 0.02  # displaced shadows

    @classmethod
    def of(cls, context: DiagnosisContext) -> LampPosition | None:
        if context.distant.any():
            return None
        names, lamp, towards = lamps_of(context, mounted=False)
        if not names:
            return None
        centre = np.where(
            lamp[:, None] >= 0, towards + (context.pixels.point - context.centre), 1.0
        )
        far = np.linalg.norm(centre, axis=1, keepdims=True)
        first, second = tangents(centre / far)
        axes = np.stack([-centre, far * first, far * second], axis=1)
        axes = np.where(lamp[:, None, None] >= 0, axes, 0.0).astype(np.float32)
        return cls(names, lamp, towards, axes, centre=centre.astype(np.float32))

    @property
    def each(self) -> int:
        return EACH

    @property
    def parameters(self) -> Parameters:
        count = len(self.names)
        names = [f"{n}, {way}" for n in self.names for way in (*WAYS, "gain")]
        units = (*("distances",) * 3, "ln") * count
        scales = (NEARNESS_SCALE, SIDE_SCALE, SIDE_SCALE, GAIN_SCALE)
        alike = Parameters.alike(names, "", 1.0, -0.7, 0.7)
        return replace(alike, units=units, deviation=np.tile(scales, count))

    @property
    def identifiable(self) -> NDArray[np.float64]:
        return mean_removal(len(self.names), EACH, EACH - 1)

    def shading(self, state: ShadingState, x: np.ndarray) -> ShadingState:
        assert self.centre is not None
        state = super().shading(state, x)
        own = self.of_lamp(x)
        moved = self.centre + np.einsum("na,nax->nx", own[:, :3], self.axes)
        as_bright = np.sum(moved**2, axis=1) / np.sum(self.centre**2, axis=1)
        gain = (as_bright * np.exp(own[:, 3])).astype(np.float32)
        return replace(state, irradiance=state.irradiance * gain[:, None])

    def sentence(self, x: np.ndarray, error: np.ndarray) -> str:
        place = x.reshape(-1, EACH)
        k = int(np.argmax(np.linalg.norm(place[:, :3], axis=1)))
        nearer, aside = place[k, 0], float(np.hypot(*place[k, 1:3]))
        return (
            f"The lamp {self.names[k]!r} stands elsewhere than stated: "
            f"{100 * abs(nearer):.0f} % {'nearer' if nearer > 0 else 'farther'} and "
            f"{np.degrees(np.arctan(aside)):.1f}° to a side, seen from the object."
        )
