"""The lamp has a size: it widens highlights and softens the edges of shadows."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from ...angles.vectors import tangents
from ..forward.diagnosis_context import DiagnosisContext, NearestPixels
from ..forward.partial_visibility import RAYS, partial_visibility, pixel_part_points
from ..forward.shading_state import ShadingState
from .base.capabilities import WidensHighlights
from .base.effect import Array
from .base.image_formation import ExtendsLamp
from .base.parameters import Parameters

RADII = np.radians([0.0, 0.5, 1.0, 2.0, 4.0, 8.0, 13.0])  # of shadow rays, about the lamp's centre
TURNS = 7  # of RAYS: step in azimuth from one ray to the next, so that all are used, unordered
MIN_DIAMETER = np.radians(1.0)  # reported above this; the sun itself is half a degree wide
PRIOR_SCALE = np.radians(6.0)  # standard deviation of the prior
STARTS = {np.radians(3.0): 12, np.radians(12.0): 24}
"""Starting value of the angular diameter (radians) → number of points that represent the lamp. Two
are tried because the effect of a wide lamp is not a multiple of that of a narrow one."""


def _disc(count: int) -> NDArray[np.float64]:
    """(count, 2) points of a sunflower pattern on a disc of radius 1, corrected so that their mean
    and second moments equal those of the disc. The mean of the plain pattern is not at the centre,
    which would act like a displaced lamp."""
    turn = np.pi * (3 - np.sqrt(5)) * np.arange(count)
    out = np.sqrt((np.arange(count) + 0.5) / count)
    points = np.stack([out * np.cos(turn), out * np.sin(turn)], axis=1)
    points -= points.mean(axis=0)
    spread = np.linalg.cholesky(points.T @ points / count)
    return np.asarray(0.5 * np.linalg.solve(spread, points.T).T)


DISCS = {start: _disc(count) for start, count in STARTS.items()}


@dataclass(frozen=True)
class AreaLight(ExtendsLamp, WidensHighlights):
    """Parameter: the angular diameter of the lamp, radians. first, other: (n, 3) unit vectors
    perpendicular to the light direction. free: (n, r) fraction of a disc of each of RADII about
    the lamp's centre that the mesh does not occlude. distant: (n,) whether the light is distant.
    start: starting value of the parameter, radians."""

    first: Array
    other: Array
    free: Array
    distant: NDArray[np.bool_]
    start: float = min(STARTS)
    cause = "area_light"
    deciding_photo = "a photo of the lamp from where the object stands"
    systematic_error = 0.02  # 12 or 24 points represent the lamp

    @classmethod
    def of(cls, context: DiagnosisContext) -> AreaLight | None:
        pixels = context.pixels
        distant = context.distant[context.light[pixels.photo]]
        if not distant.any():
            return None
        first, other = (v.astype(np.float32) for v in tangents(pixels.light))
        ring = np.empty((len(pixels), len(RADII)))
        ring[:, 0] = pixels.visible
        parts = pixel_part_points(context.rays, pixels)
        for k, radius in enumerate(RADII[1:], start=1):

            def towards(ray: int, radius: float = radius) -> Array:
                turn = 2 * np.pi * (TURNS * ray % RAYS) / RAYS
                aside = np.tan(radius) * (np.cos(turn) * first + np.sin(turn) * other)
                return (pixels.light + aside) * np.float32(np.cos(radius))

            # computed like the visibility of the point lamp; otherwise the pixels at shadow edges
            # alone would suggest a lamp with a size
            ring[:, k] = partial_visibility(context.rays, pixels, towards, parts=parts)
        # disc: integral over rings, linear between them
        middle = 0.5 * (ring[:, 1:] + ring[:, :-1]) * np.diff(RADII**2)
        free = ring.copy()
        free[:, 1:] = np.cumsum(middle, axis=1) / RADII[1:] ** 2
        return cls(first, other, free.astype(np.float32), distant)

    def at_pixels(self, context: DiagnosisContext, nearest: NearestPixels) -> AreaLight | None:
        found = AreaLight.of(context)
        return None if found is None else replace(found, start=self.start)

    @property
    def parameters(self) -> Parameters:
        return Parameters.alike(
            ["angular diameter"],
            "rad",
            PRIOR_SCALE,
            0.0,
            2 * RADII[-1],
            step=2e-3,
            start=self.start,
        )

    @property
    def starts(self) -> Sequence[AreaLight]:
        return [replace(self, start=start) for start in STARTS]

    def is_relevant(self, x: np.ndarray) -> bool:
        return bool(x[0] > MIN_DIAMETER)

    def lamp_parts(self, state: ShadingState, x: np.ndarray) -> list[ShadingState]:
        radius = np.clip(x[0] / 2, 0, RADII[-1])
        if radius < 1e-5:
            return [state]
        k = min(int(np.searchsorted(RADII, radius, side="right")), len(RADII) - 1)
        share = (radius - RADII[k - 1]) / (RADII[k] - RADII[k - 1])
        free = (1 - share) * self.free[:, k - 1] + share * self.free[:, k]
        visible = np.clip(state.visible + free - state.pixels.visible, 0, 1)
        visible = np.where(self.distant, visible, state.visible)
        parts = []
        for first, other in np.tan(radius) * DISCS[self.start]:
            aside = first * self.first + other * self.other
            towards = state.light + np.where(self.distant[:, None], aside, 0).astype(np.float32)
            towards /= np.linalg.norm(towards, axis=1, keepdims=True)
            parts.append(replace(state, light=towards, visible=visible))
        return parts

    def sentence(self, x: np.ndarray, error: np.ndarray) -> str:
        return (
            f"The lamp is not a point: its angular diameter is {np.degrees(x[0]):.1f}° seen from "
            "the object, so highlights are wider and the edges of shadows softer than under a "
            "point lamp."
        )
