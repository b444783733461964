"""A proposed photo: where its camera and its lamp stand, what it is expected to gain, in words."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from ..scan import Camera
from .candidates import directions_to

Array = NDArray[np.float64]

SIDES = ("right", "upper right", "top", "upper left", "left", "lower left", "bottom", "lower right")
OPPOSITE = 155.0  # degrees between camera and lamp from which no side is named
NEAR_CAMERA = 10.0  # the same below which the lamp stands at the camera


@dataclass(frozen=True)
class ProposedPhoto:
    """A photo to take next.

    camera: label of the scan's camera whose viewpoint it shares. towards: (3,) unit direction from
    the object to the lamp, scan frame; None for the flash on the camera. angle: degrees between the
    directions to the lamp and to the camera, as seen from the object. side: degrees, the direction
    of the lamp in the photo, 0 to the right, 90 upwards. before, after: RMS standard deviation of
    ln(ρ·cosMap + ε) over lights and views within 80° of the normal, mean of the materials, now and
    as expected with this photo.
    """

    camera: str
    towards: Array | None
    angle: float
    side: float
    before: float
    after: float

    @classmethod
    def of(
        cls, camera: Camera, centre: Array, towards: Array | None, before: float, after: float
    ) -> ProposedPhoto:
        """A photo from a camera of the scan, with a lamp in the direction ``towards``. centre: (3,)
        of the object."""
        if towards is None:
            return cls(camera.label, None, 0.0, 0.0, before, after)
        view = directions_to(camera, centre[None])[0]
        right, down = camera.pose.rotation[:2] @ towards
        angle = np.degrees(np.arccos(np.clip(view @ towards, -1.0, 1.0)))
        side = np.degrees(np.arctan2(-down, right)) % 360.0
        return cls(camera.label, towards, float(angle), float(side), before, after)

    @property
    def gain(self) -> float:
        """Relative decrease of the standard deviation."""
        return 1.0 - self.after / self.before

    @property
    def sentence(self) -> str:
        """What to do, and what it is expected to gain."""
        return (
            f"{self._where()}. Expected: the uncertainty of the BRDF decreases by "
            f"{100 * self.gain:.0f} %."
        )

    def _where(self) -> str:
        if self.towards is None:
            return f"From the viewpoint of {self.camera}, with the flash"
        if self.angle > OPPOSITE:
            lamp = "behind the object, opposite the camera"
        elif self.angle < NEAR_CAMERA:
            lamp = "next to the camera"
        else:
            side = SIDES[round(self.side / 45.0) % len(SIDES)]
            behind = "behind the object, " if self.angle > 90.0 else ""
            lamp = f"{behind}at the {side} of the photo, {self.angle:.0f}° from the camera"
        return f"From the viewpoint of {self.camera}, with the lamp {lamp}"
