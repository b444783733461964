"""Reflections of the surroundings: a window, a softbox, a white wall."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ...angles.vectors import even_directions
from ..forward.diagnosis_context import DiagnosisContext, NearestPixels
from ..forward.material_brdfs import MaterialBRDFs
from ..forward.shading_state import ShadingState
from ..forward.surroundings import ACCURACY
from .base.capabilities import BuiltFromBRDFs
from .base.effect import Array
from .base.image_formation import AddsRadiance
from .base.parameters import Parameters

LOBES = 64  # lobes that describe the radiance of the surroundings
SHARP = 21.0  # sharpness of a lobe: half as bright 15° from its axis; the next axis is 24° away
FINER = 8  # factor in number and sharpness of the lobes that are added where it is bright
CHUNK = 32  # pixels at a time, so that the processor's cache holds their directions
MAX_FINE_LOBES = 128  # added lobes at most
DIM = 0.1  # of the largest radiance; no lobes are added where it is darker


@dataclass(frozen=True)
class EnvironmentReflection(AddsRadiance, BuiltFromBRDFs):
    """Parameters: radiance of the surroundings in the lobe about each of ``directions`` (l, 3),
    divided by (irradiance of the lamp / π). sharp: (l,) sharpness of each lobe. reflected:
    (l, n, 3) light that the surface reflects of a lobe whose parameter is 1."""

    directions: Array
    sharp: Array
    reflected: Array
    cause = "environment_reflection"
    systematic_error = ACCURACY
    deciding_photo = "one photo with the lamp off"

    @classmethod
    def of(cls, context: DiagnosisContext) -> EnvironmentReflection:
        return cls._towards(context, even_directions(LOBES), np.full(LOBES, SHARP))

    @classmethod
    def _towards(
        cls, context: DiagnosisContext, directions: Array, sharp: Array
    ) -> EnvironmentReflection:
        around = context.surroundings
        level = context.pixel_level / np.pi
        reflected = np.empty((len(directions), len(level), 3), np.float32)
        axes, sharpness = (sharp * directions.T).astype(np.float32), sharp.astype(np.float32)
        for start in range(0, len(level), CHUNK):
            rows = slice(start, start + CHUNK)
            bright = around.towards[rows] @ axes  # (rows, d, lobes)
            bright -= sharpness
            np.exp(bright, out=bright)
            of_open = around.reflected[rows] * around.open[rows, :, None]
            of_lobes = np.matmul(of_open.transpose(0, 2, 1), bright)
            reflected[:, rows] = (level[rows, :, None] * of_lobes).transpose(2, 0, 1)
        return cls(directions, sharp, reflected)

    def at_pixels(self, context: DiagnosisContext, nearest: NearestPixels) -> EnvironmentReflection:
        return self._towards(context, self.directions, self.sharp)

    def rebuilt(self, context: DiagnosisContext, x: np.ndarray) -> EnvironmentReflection:
        """With more and sharper lobes where the surroundings are bright. The reflected edge of a
        window is sharp; if the lobes were too wide, a tone curve would explain the rest."""
        finer = even_directions(FINER * LOBES)
        radiance = self.radiance(finer, x)
        brightest = np.argsort(-radiance)[:MAX_FINE_LOBES]
        brightest = brightest[radiance[brightest] > DIM * radiance.max()]
        directions = np.concatenate([even_directions(LOBES), finer[brightest]])
        sharp = np.repeat([SHARP, FINER * SHARP], [LOBES, len(brightest)])
        return self._towards(context, directions, sharp)

    def radiance(self, towards: Array, x: np.ndarray) -> Array:
        """(m,) of the surroundings towards (m, 3), over the lamp's irradiance / π."""
        return np.asarray(np.exp(self.sharp * (towards @ self.directions.T - 1)) @ x)

    @property
    def parameters(self) -> Parameters:
        names = [f"({x:.2f}, {y:.2f}, {z:.2f})" for x, y, z in self.directions]
        return Parameters.alike(names, "of E/π", 0.2, 0.0, 20.0)

    def added_radiance(self, state: ShadingState, brdfs: MaterialBRDFs, x: np.ndarray) -> Array:
        return np.tensordot(x.astype(np.float32), self.reflected, 1)

    def sentence(self, x: np.ndarray, error: np.ndarray) -> str:
        radiance = self.radiance(self.directions, x)
        bright = self.directions[int(np.argmax(radiance))]
        return (
            "The object reflects its surroundings. They are brightest in the direction "
            f"({bright[0]:.1f}, {bright[1]:.1f}, {bright[2]:.1f}) in the scan's frame: "
            f"{100 * float(radiance.max()):.0f} % of the radiance of a white wall lit by the "
            "lamp."
        )
