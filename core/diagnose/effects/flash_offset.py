"""A lamp on the camera that stands elsewhere from the lens than the capture states."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from ..forward.diagnosis_context import DiagnosisContext
from .base.displaced_lamp import DisplacedLamp, lamps_of
from .base.parameters import Parameters

PRIOR_SCALES = (0.15, 0.15, 0.05)
"""Standard deviations of the prior for right, down and forward, in mean distances of the lamp. A
displacement forward is hardly distinguishable from a narrower beam."""
BOUND = 0.6  # of every parameter, in mean distances of the lamp
EACH = 3  # parameters of a lamp
WAYS = ("right", "down", "forward")


@dataclass(frozen=True)
class FlashOffset(DisplacedLamp):
    """Parameters: for each lamp on the camera its displacement to the right, down and forward, scan
    units. distance: (lamps,) mean distance from the surface, scan units."""

    distance: NDArray[np.float64] | None = None
    cause = "flash_offset"
    deciding_photo = "two photos of one view, the second with the camera upside down"
    systematic_error = 0.02  # displaced shadows

    @classmethod
    def of(cls, context: DiagnosisContext) -> FlashOffset | None:
        names, lamp, towards = lamps_of(context, mounted=True)
        if not names:
            return None
        axes = context.rig.axes[context.pixels.photo].astype(np.float32)
        lamps = context.rig.lamp[context.rig.mounted] - context.centre
        distance = float(np.mean(np.linalg.norm(lamps, axis=1)))
        return cls(names, lamp, towards, axes, distance=np.full(len(names), distance))

    @property
    def each(self) -> int:
        return EACH

    @property
    def parameters(self) -> Parameters:
        assert self.distance is not None
        names = [f"{name}, {way}" for name in self.names for way in WAYS]
        scale = np.repeat(self.distance, EACH)
        return replace(
            Parameters.alike(names, "scan units", 1.0),
            deviation=np.tile(PRIOR_SCALES, len(self.names)) * scale,
            low=-BOUND * scale, high=BOUND * scale, step=1e-3 * scale,
        )  # fmt: skip

    def sentence(self, x: np.ndarray, error: np.ndarray) -> str:
        place = x.reshape(-1, EACH)
        k = int(np.argmax(np.linalg.norm(place, axis=1)))
        right, down, forward = place[k]
        sure = error.reshape(-1, EACH)[k]
        return (
            f"The lamp {self.names[k]!r} on the camera is elsewhere than stated: "
            f"{abs(right):.3g} ± {sure[0]:.2g} scan units to the "
            f"{'right' if right > 0 else 'left'}, {abs(down):.3g} ± {sure[1]:.2g} "
            f"{'down' if down > 0 else 'up'} and {abs(forward):.3g} ± {sure[2]:.2g} "
            f"{'forward' if forward > 0 else 'backward'}, seen from behind the camera."
        )
