"""Lamps at a finite distance that stand elsewhere than the capture states."""

from __future__ import annotations

from abc import abstractmethod
from dataclasses import dataclass, replace
from typing import Self

import numpy as np
from numpy.typing import NDArray

from ....angles.vectors import dot
from ...forward.diagnosis_context import DiagnosisContext, NearestPixels
from ...forward.shading_state import ShadingState
from .capabilities import DisplacesLamp
from .displaced_shadows import DisplacedShadows
from .effect import Array, Vector
from .image_formation import ChangesShading
from .parameters import parameter_columns

NEAREST = 0.05  # of the distance: a displaced lamp does not come closer to a point


@dataclass(frozen=True)
class DisplacedLamp(ChangesShading, DisplacesLamp):
    """The first three parameters of each lamp displace it along three axes.

    names: of the lamps. lamp: (n,) number of each pixel's lamp, −1 another light. towards: (n, 3)
    from the point to the lamp, scan units. axes: (n, 3, 3) rows: displacement by a parameter of 1.
    shadows: traced for the displacements that were found.
    """

    names: tuple[str, ...]
    lamp: NDArray[np.intp]
    towards: Array
    axes: Array
    shadows: DisplacedShadows | None = None

    @classmethod
    @abstractmethod
    def of(cls, context: DiagnosisContext) -> Self | None:
        """The effect for a capture; None where it has no such lamp."""

    @property
    @abstractmethod
    def each(self) -> int:
        """Parameters of a lamp, at least 3."""

    def at_pixels(self, context: DiagnosisContext, nearest: NearestPixels) -> Self:
        found = type(self).of(context)
        assert found is not None
        return found if self.shadows is None else found.with_rays(context, self.shadows.x)

    @property
    def parameter_index(self) -> NDArray[np.intp]:
        return parameter_columns(self.lamp, self.each)

    def with_rays(self, context: DiagnosisContext, x: Vector) -> Self:
        return replace(self, shadows=DisplacedShadows.of(context, replace(self, shadows=None), x))

    def of_lamp(self, x: Vector) -> Array:
        """(n, each) parameters of each pixel's lamp, 0 for other lights."""
        values = x.reshape(-1, self.each)[self.lamp]
        return np.where(self.lamp[:, None] >= 0, values, 0.0).astype(np.float32)

    def shading(self, state: ShadingState, x: Vector) -> ShadingState:
        state = state if self.shadows is None else self.shadows.on(state)
        moved = self.towards + np.einsum("na,nax->nx", self.of_lamp(x)[:, :3], self.axes)
        was, now = (np.sqrt(dot(v, v)) for v in (self.towards, moved))
        now = np.maximum(now, NEAREST * was)
        there = self.lamp >= 0
        factor = np.where(there, np.square(was / np.maximum(now, 1e-30)), 1.0)
        light = np.where(there[:, None], moved / np.maximum(now, 1e-30)[:, None], state.light)
        irradiance = state.irradiance * factor[:, None].astype(np.float32)
        return replace(state, light=light.astype(np.float32), irradiance=irradiance)


def lamps_of(
    context: DiagnosisContext, mounted: bool
) -> tuple[tuple[str, ...], NDArray[np.intp], Array]:
    """(names, (n,) number of each pixel's lamp or −1, (n, 3) from each point to its lamp, 0 for
    other lights) of the lamps at a finite distance that are fixed to the camera, or are not."""
    rig, pixels = context.rig, context.pixels
    chosen = ~np.isnan(rig.lamp).any(axis=1) & (rig.mounted == mounted)
    numbers = np.unique(context.light[chosen])
    place = np.full(len(context.lights), -1)
    place[numbers] = np.arange(len(numbers))
    lamp = np.where(chosen[pixels.photo], place[context.light[pixels.photo]], -1)
    towards = np.where(lamp[:, None] >= 0, rig.lamp[pixels.photo] - pixels.point, 0.0)
    return tuple(context.lights[k] for k in numbers), lamp, towards.astype(np.float32)
