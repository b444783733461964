"""Where in the formation of a photo an effect acts.

Light falls on the surface (ChangesShading, ExtendsLamp), other light reaches the pixel
(AddsRadiance), and the camera records it (ChangesRecording).
"""

from __future__ import annotations

from abc import ABC, abstractmethod

from ...forward.material_brdfs import MaterialBRDFs
from ...forward.shading_state import ShadingState
from .effect import Array, Effect, Vector


class ChangesShading(Effect, ABC):
    """Surface, light or visibility differ from the capture's."""

    @abstractmethod
    def shading(self, state: ShadingState, x: Vector) -> ShadingState:
        """Surface and light with the effect."""


class ExtendsLamp(Effect, ABC):
    """The lamp is not a point."""

    @abstractmethod
    def lamp_parts(self, state: ShadingState, x: Vector) -> list[ShadingState]:
        """One shading state for each of the lamp's parts, which are equally bright."""


class AddsRadiance(Effect, ABC):
    """Light reaches the pixel that the lamp did not send directly."""

    @abstractmethod
    def added_radiance(self, state: ShadingState, brdfs: MaterialBRDFs, x: Vector) -> Array:
        """(n, 3) radiance that is added to the reflected light of the lamp."""


class ChangesRecording(Effect, ABC):
    """The photo is not proportional to the radiance that reaches the camera."""

    @abstractmethod
    def recorded(self, radiance: Array, state: ShadingState, x: Vector) -> Array:
        """(n, 3) recorded radiance. radiance: (n, 3) that reaches the camera."""


class CameraEffect(ChangesRecording, ABC):
    """The camera causes it, and a camera does the same to all materials."""


def changes_lamp_light(effect: Effect) -> bool:
    """Whether the effect changes the reflected light of the lamp."""
    return isinstance(effect, ChangesShading | ExtendsLamp)
