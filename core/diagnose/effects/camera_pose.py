"""Photos are not where the scan says: what they show is shifted and turned."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from ..dark_spots import DIM
from ..effect import Array, Effect, Near, Numbers, Setting, felt_by
from ..moved_view import MovedView
from ..situation import Situation

USUAL = 1.0  # pixels
AFAR = np.linspace(-7.5, 7.5, 7)  # pixels right, and down, that are tried,
NEARER, TURNS = (1.0, 0.5, 0.25), 2  # then steps about the best, and how often each way
FEWEST = 50  # lit pixels of a photo that is sought so
PART = 0.05  # of a pixel, which edges of shadows between facets are off by
BESIDE = 2.0  # pixels from the edge of a shadow, where light changes, not the normal alone


@dataclass(frozen=True)
class CameraPose(Effect):
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
    seen: MovedView | None = None
    cause = "camera_pose"
    accuracy = 0.05  # a camera that is turned does not shift all of its photo alike
    proof = "the same photos aligned again, with more landmarks"

    @classmethod
    def of(cls, setting: Setting) -> CameraPose:
        pixels = setting.pixels
        photos, place = np.unique(pixels.photo, return_inverse=True)
        beside = pixels.edge < BESIDE
        return cls(
            tuple(photos.tolist()), place.ravel(), pixels.turn, pixels.step, pixels.slope, beside,
            pixels.x, pixels.y,
        )  # fmt: skip

    def elsewhere(self, setting: Setting, near: Near) -> CameraPose:
        pixels = setting.pixels
        found = replace(
            self, photo=self.photo[near.photo], turn=self.turn[near.photo],
            step=self.step[near.photo], slope=pixels.slope, beside=pixels.edge < BESIDE,
            x=pixels.x, y=pixels.y, seen=None,
        )  # fmt: skip
        if self.seen is None:
            return found
        return replace(found, seen=found._seen(setting, self.seen.x).dark_where_it_ends)

    def casting(self, setting: Setting, x: np.ndarray) -> CameraPose:
        return replace(self, seen=self._seen(setting, x.copy()))

    def sought(
        self, setting: Setting, x: np.ndarray, shown: Callable[[Effect, np.ndarray], Array]
    ) -> np.ndarray:
        """Photo by photo by trial, all photos at once: edges of shadows and outlines have no slope
        that leads to them from afar, and to a robust fit they are outliers. Once is enough."""
        if self.seen is not None:
            return x
        low, high = self.numbers.low[0], self.numbers.high[0]
        # of roots neither highlights nor noise count most
        truth = np.sqrt(np.maximum(setting.pixels.observed, 0))

        def missed(x: np.ndarray) -> NDArray[np.float64]:
            moved = self.casting(setting, x)
            assert moved.seen is not None
            off = np.sqrt(np.maximum(shown(moved, x), 0)) - truth
            told = moved.seen.known & setting.pixels.usable
            each = np.square(off).mean(axis=1)[told]
            photo, count = self.photo[told], len(self.photos)
            return np.bincount(photo, each, count) / np.maximum(np.bincount(photo, None, count), 1)

        lit = setting.pixels.observed.sum(axis=1)
        lit = lit > DIM * np.percentile(lit, 90)
        enough = np.bincount(self.photo, lit, len(self.photos)) >= FEWEST
        best, least = x, np.where(enough, missed(x), -np.inf)

        def better(tried: np.ndarray) -> None:
            nonlocal best, least
            tried = np.clip(tried, low, high)
            costs = missed(tried)
            best = np.where(np.repeat(costs < least, 3), tried, best)
            least = np.minimum(costs, least)

        for right, down in np.stack(np.meshgrid(AFAR, AFAR), axis=-1).reshape(-1, 2):
            better(np.tile([right, down, 0.0], len(self.photos)))
        for size in NEARER:
            for way in np.concatenate([np.eye(3), -np.eye(3)] * TURNS):
                better(best + np.tile(size * way, len(self.photos)))
        return best

    def _seen(self, setting: Setting, x: np.ndarray) -> MovedView:
        pixels = replace(setting.pixels, turn=self.turn, step=self.step)
        return MovedView.of(replace(setting, pixels=pixels), self._moved(self.step, x), x)

    @property
    def _ends(self) -> NDArray[np.bool_]:
        """(n,) whether light may change there, not the normal alone."""
        if self.seen is None:
            return self.beside
        return np.where(self.seen.known, self.seen.ends, self.beside)

    def own_error(self, x: np.ndarray) -> np.ndarray:
        return np.repeat(np.hypot(self.accuracy * np.hypot(x[0::3], x[1::3]), PART), 3)

    @property
    def numbers(self) -> Numbers:
        names = [f"photo {p + 1}, {way}" for p in self.photos for way in ("right", "down", "turn")]
        found = Numbers.alike(names, "px", USUAL, -8.0, 8.0, step=0.01)
        return found if self.seen is None else replace(found, start=self.seen.x)

    @property
    def feels(self) -> NDArray[np.intp]:
        return felt_by(self.photo, 3)

    def before(self, now: Situation, x: np.ndarray) -> Situation:
        if not x.any():
            return now
        turned = np.where(self._ends[:, None], 0, self._rest(self.turn, x))
        visible = now.visible
        if self.seen is not None:
            turned += self.seen.more
            more = self.seen.visible - now.pixels.visible
            visible = np.clip(visible + more, 0, 1).astype(np.float32)
        normal = now.normal + turned
        normal /= np.linalg.norm(normal, axis=1, keepdims=True)
        return replace(now, normal=normal, visible=visible)

    def after(self, radiance: Array, now: Situation, x: np.ndarray) -> Array:
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

    def sentence(self, x: np.ndarray, deviation: np.ndarray) -> str:
        far = np.hypot(x[0::3], x[1::3])
        worst = int(np.argmax(far))
        return (
            f"photos do not lie where the scan says: photo {self.photos[worst] + 1} by "
            f"{far[worst]:.1f} pixels, {np.sqrt(np.mean(far**2)):.1f} on average"
        )
