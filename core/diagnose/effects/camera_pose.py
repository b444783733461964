"""Errors of the camera poses: the image of the scan is shifted and rotated in each photo."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from ..forward.diagnosis_context import DiagnosisContext, NearestPixels
from ..forward.shading_state import ShadingState
from ..pixels.unexplained_shadows import DIM
from .base.capabilities import TracesRays
from .base.displaced_view import DisplacedView
from .base.effect import Array, Effect
from .base.image_formation import ChangesRecording, ChangesShading
from .base.parameters import Parameters, parameter_columns

PRIOR_SCALE = 1.0  # pixels, standard deviation of the prior
# grid search, pixels: shifts to the right and down, then steps about the best, with rounds per step
SHIFTS = np.linspace(-7.5, 7.5, 7)
FINE_STEPS, ROUNDS_PER_STEP = (1.0, 0.5, 0.25), 2
MIN_BRIGHT_PIXELS = 50  # bright pixels that a photo needs for this search
EDGE_ERROR = 0.05  # pixels, error of the shadow edges between facets
EDGE_DISTANCE = 2.0  # pixels from a shadow edge within which not only the normal, but light changes


@dataclass(frozen=True)
class CameraPose(ChangesShading, ChangesRecording, TracesRays):
    """Parameters: for each photo a shift to the right, a shift down, and a rotation, in pixels (the
    rotation: displacement at half the diagonal). turn: (n, 2, 3) change of the normal, step:
    (n, 2, 3) change of the point, slope: (n, 2, 3) change of the observed radiance, each per pixel
    to the right and per pixel down. near_edge: (n,) whether the edge of a shadow is near. x, y:
    (n,) in half diagonals. seen: the surface found by rays, once the poses are approximately known.

    A pixel shows a neighbouring point of the surface. Within a pixel the normal changes linearly,
    but the reflected light does not (a highlight has a maximum). Near the edge of a shadow the
    light changes instead, which is treated as linear until rays have located the edge.
    """

    photos: tuple[int, ...]
    photo: NDArray[np.intp]
    turn: Array
    step: Array
    slope: Array
    near_edge: NDArray[np.bool_]
    x: Array
    y: Array
    seen: DisplacedView | None = None
    cause = "camera_pose"
    systematic_error = 0.05  # a rotated camera does not shift all of its photo equally
    deciding_photo = "the same photos aligned again, with more landmarks"

    @classmethod
    def of(cls, context: DiagnosisContext) -> CameraPose:
        pixels = context.pixels
        photos, place = np.unique(pixels.photo, return_inverse=True)
        near_edge = pixels.edge < EDGE_DISTANCE
        return cls(
            tuple(photos.tolist()), place.ravel(), pixels.turn, pixels.step, pixels.slope,
            near_edge, pixels.x, pixels.y,
        )  # fmt: skip

    def at_pixels(self, context: DiagnosisContext, nearest: NearestPixels) -> CameraPose:
        pixels = context.pixels
        found = replace(
            self, photo=self.photo[nearest.photo], turn=self.turn[nearest.photo],
            step=self.step[nearest.photo], slope=pixels.slope,
            near_edge=pixels.edge < EDGE_DISTANCE, x=pixels.x, y=pixels.y, seen=None,
        )  # fmt: skip
        if self.seen is None:
            return found
        return replace(found, seen=found._seen(context, self.seen.x).dark_where_it_ends)

    def with_rays(self, context: DiagnosisContext, x: np.ndarray) -> CameraPose:
        return replace(self, seen=self._seen(context, x.copy()))

    def ray_parameters(
        self,
        context: DiagnosisContext,
        x: np.ndarray,
        predict: Callable[[Effect, np.ndarray], Array],
    ) -> np.ndarray:
        """Grid search, all photos at once. Shadow edges and outlines have no gradient at a
        distance, and a robust fit treats them as outliers. It is done once."""
        if self.seen is not None:
            return x
        low, high = self.parameters.low[0], self.parameters.high[0]
        # square roots, so that neither highlights nor noise dominate
        truth = np.sqrt(np.maximum(context.pixels.observed, 0))

        def squared_error(x: np.ndarray) -> NDArray[np.float64]:
            moved = self.with_rays(context, x)
            assert moved.seen is not None
            off = np.sqrt(np.maximum(predict(moved, x), 0)) - truth
            valid = moved.seen.known & context.pixels.usable
            each = np.square(off).mean(axis=1)[valid]
            photo, count = self.photo[valid], len(self.photos)
            return np.bincount(photo, each, count) / np.maximum(np.bincount(photo, None, count), 1)

        lit = context.pixels.observed.sum(axis=1)
        lit = lit > DIM * np.percentile(lit, 90)
        enough = np.bincount(self.photo, lit, len(self.photos)) >= MIN_BRIGHT_PIXELS
        best, least = x, np.where(enough, squared_error(x), -np.inf)

        def better(tried: np.ndarray) -> None:
            nonlocal best, least
            tried = np.clip(tried, low, high)
            costs = squared_error(tried)
            best = np.where(np.repeat(costs < least, 3), tried, best)
            least = np.minimum(costs, least)

        for right, down in np.stack(np.meshgrid(SHIFTS, SHIFTS), axis=-1).reshape(-1, 2):
            better(np.tile([right, down, 0.0], len(self.photos)))
        for size in FINE_STEPS:
            for way in np.concatenate([np.eye(3), -np.eye(3)] * ROUNDS_PER_STEP):
                better(best + np.tile(size * way, len(self.photos)))
        return best

    def _seen(self, context: DiagnosisContext, x: np.ndarray) -> DisplacedView:
        pixels = replace(context.pixels, turn=self.turn, step=self.step)
        return DisplacedView.of(replace(context, pixels=pixels), self._moved(self.step, x), x)

    @property
    def _ends(self) -> NDArray[np.bool_]:
        """(n,) whether the light may change there, not only the normal."""
        if self.seen is None:
            return self.near_edge
        return np.where(self.seen.known, self.seen.ends, self.near_edge)

    def systematic_errors(self, x: np.ndarray) -> np.ndarray:
        return np.repeat(
            np.hypot(self.systematic_error * np.hypot(x[0::3], x[1::3]), EDGE_ERROR), 3
        )

    @property
    def parameters(self) -> Parameters:
        names = [f"photo {p + 1}, {way}" for p in self.photos for way in ("right", "down", "turn")]
        found = Parameters.alike(names, "px", PRIOR_SCALE, -8.0, 8.0, step=0.01)
        return found if self.seen is None else replace(found, start=self.seen.x)

    @property
    def parameter_index(self) -> NDArray[np.intp]:
        return parameter_columns(self.photo, 3)

    def shading(self, state: ShadingState, x: np.ndarray) -> ShadingState:
        if not x.any():
            return state
        turned = np.where(self._ends[:, None], 0, self._rest(self.turn, x))
        visible = state.visible
        if self.seen is not None:
            turned += self.seen.more
            more = self.seen.visible - state.pixels.visible
            visible = np.clip(visible + more, 0, 1).astype(np.float32)
        normal = state.normal + turned
        normal /= np.linalg.norm(normal, axis=1, keepdims=True)
        return replace(state, normal=normal, visible=visible)

    def recorded(self, radiance: Array, state: ShadingState, x: np.ndarray) -> Array:
        if not x.any():
            return radiance
        return radiance + np.where(self._ends[:, None], self._rest(self.slope, x), 0)

    def _moved(self, slope: Array, x: np.ndarray) -> Array:
        """(n, 3) change of a quantity between the expected and the displaced point. slope:
        (n, 2, 3) its change per pixel."""
        right, down, turn = (x[k::3][self.photo] for k in range(3))
        along = (right - turn * self.y)[:, None] * slope[:, 0]
        along += (down + turn * self.x)[:, None] * slope[:, 1]
        return np.asarray(along, np.float32)

    def _rest(self, slope: Array, x: np.ndarray) -> Array:
        """(n, 3) the part of that change that the traced rays do not include already."""
        moved = self._moved(slope, x)
        if self.seen is None:
            return moved
        return moved - np.where(self.seen.known[:, None], self._moved(slope, self.seen.x), 0)

    def sentence(self, x: np.ndarray, error: np.ndarray) -> str:
        far = np.hypot(x[0::3], x[1::3])
        worst = int(np.argmax(far))
        return (
            f"Camera poses are off by {np.sqrt(np.mean(far**2)):.1f} pixels on average; the "
            f"largest error is {far[worst]:.1f} pixels (photo {self.photos[worst] + 1})."
        )
