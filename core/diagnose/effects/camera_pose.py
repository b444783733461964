"""Photos are not where the scan says: what they show is shifted and turned."""

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

USUAL = 1.0  # pixels
AFAR = np.linspace(-7.5, 7.5, 7)  # pixels right, and down, that are tried,
NEARER, TURNS = (1.0, 0.5, 0.25), 2  # then steps about the best, and how often each way
FEWEST = 50  # lit pixels of a photo that is sought so
PART = 0.05  # of a pixel, which edges of shadows between facets are off by
BESIDE = 2.0  # pixels from the edge of a shadow, where light changes, not the normal alone


@dataclass(frozen=True)
class CameraPose(ChangesShading, ChangesRecording, TracesRays):
    """numbers: for each photo a shift to the right and down, and a turn, in pixels (of the turn:
    at half the diagonal). turn: (n, 2, 3) of the normal, step: (n, 2, 3) of the point, slope:
    (n, 2, 3) of what the photo shows, a pixel to the right and down. beside: (n,) whether the edge
    of a shadow is near. x, y: (n,) in half diagonals. seen: what rays say of the surface, once it
    is known about where photos lie.

    A pixel shows the surface beside the one that it should. Over a pixel normals turn evenly, but
    what they reflect does not change so (a highlight has a top); beside the edge of a shadow it is
    light that changes, evenly too until rays say where the edge is.
    """

    photos: tuple[int, ...]
    photo: NDArray[np.intp]
    turn: Array
    step: Array
    slope: Array
    beside: NDArray[np.bool_]
    x: Array
    y: Array
    seen: DisplacedView | None = None
    cause = "camera_pose"
    systematic_error = 0.05  # a camera that is turned does not shift all of its photo alike
    deciding_photo = "the same photos aligned again, with more landmarks"

    @classmethod
    def of(cls, context: DiagnosisContext) -> CameraPose:
        pixels = context.pixels
        photos, place = np.unique(pixels.photo, return_inverse=True)
        beside = pixels.edge < BESIDE
        return cls(
            tuple(photos.tolist()), place.ravel(), pixels.turn, pixels.step, pixels.slope, beside,
            pixels.x, pixels.y,
        )  # fmt: skip

    def at_pixels(self, context: DiagnosisContext, nearest: NearestPixels) -> CameraPose:
        pixels = context.pixels
        found = replace(
            self, photo=self.photo[nearest.photo], turn=self.turn[nearest.photo],
            step=self.step[nearest.photo], slope=pixels.slope, beside=pixels.edge < BESIDE,
            x=pixels.x, y=pixels.y, seen=None,
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
        """Photo by photo by trial, all photos at once: edges of shadows and outlines have no slope
        that leads to them from afar, and to a robust fit they are outliers. Once is enough."""
        if self.seen is not None:
            return x
        low, high = self.parameters.low[0], self.parameters.high[0]
        # of roots neither highlights nor noise count most
        truth = np.sqrt(np.maximum(context.pixels.observed, 0))

        def squared_error(x: np.ndarray) -> NDArray[np.float64]:
            moved = self.with_rays(context, x)
            assert moved.seen is not None
            off = np.sqrt(np.maximum(predict(moved, x), 0)) - truth
            told = moved.seen.known & context.pixels.usable
            each = np.square(off).mean(axis=1)[told]
            photo, count = self.photo[told], len(self.photos)
            return np.bincount(photo, each, count) / np.maximum(np.bincount(photo, None, count), 1)

        lit = context.pixels.observed.sum(axis=1)
        lit = lit > DIM * np.percentile(lit, 90)
        enough = np.bincount(self.photo, lit, len(self.photos)) >= FEWEST
        best, least = x, np.where(enough, squared_error(x), -np.inf)

        def better(tried: np.ndarray) -> None:
            nonlocal best, least
            tried = np.clip(tried, low, high)
            costs = squared_error(tried)
            best = np.where(np.repeat(costs < least, 3), tried, best)
            least = np.minimum(costs, least)

        for right, down in np.stack(np.meshgrid(AFAR, AFAR), axis=-1).reshape(-1, 2):
            better(np.tile([right, down, 0.0], len(self.photos)))
        for size in NEARER:
            for way in np.concatenate([np.eye(3), -np.eye(3)] * TURNS):
                better(best + np.tile(size * way, len(self.photos)))
        return best

    def _seen(self, context: DiagnosisContext, x: np.ndarray) -> DisplacedView:
        pixels = replace(context.pixels, turn=self.turn, step=self.step)
        return DisplacedView.of(replace(context, pixels=pixels), self._moved(self.step, x), x)

    @property
    def _ends(self) -> NDArray[np.bool_]:
        """(n,) whether light may change there, not the normal alone."""
        if self.seen is None:
            return self.beside
        return np.where(self.seen.known, self.seen.ends, self.beside)

    def systematic_errors(self, x: np.ndarray) -> np.ndarray:
        return np.repeat(np.hypot(self.systematic_error * np.hypot(x[0::3], x[1::3]), PART), 3)

    @property
    def parameters(self) -> Parameters:
        names = [f"photo {p + 1}, {way}" for p in self.photos for way in ("right", "down", "turn")]
        found = Parameters.alike(names, "px", USUAL, -8.0, 8.0, step=0.01)
        return found if self.seen is None else replace(found, start=self.seen.x)

    @property
    def columns(self) -> NDArray[np.intp]:
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
        """(n, 3) what a quantity of these slopes (n, 2, 3) is more at the place that is shown."""
        right, down, turn = (x[k::3][self.photo] for k in range(3))
        along = (right - turn * self.y)[:, None] * slope[:, 0]
        along += (down + turn * self.x)[:, None] * slope[:, 1]
        return np.asarray(along, np.float32)

    def _rest(self, slope: Array, x: np.ndarray) -> Array:
        """(n, 3) of that, what rays do not say already."""
        moved = self._moved(slope, x)
        if self.seen is None:
            return moved
        return moved - np.where(self.seen.known[:, None], self._moved(slope, self.seen.x), 0)

    def sentence(self, x: np.ndarray, error: np.ndarray) -> str:
        far = np.hypot(x[0::3], x[1::3])
        worst = int(np.argmax(far))
        return (
            f"photos do not lie where the scan says: photo {self.photos[worst] + 1} by "
            f"{far[worst]:.1f} pixels, {np.sqrt(np.mean(far**2)):.1f} on average"
        )
