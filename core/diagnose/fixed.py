"""An effect whose numbers are known."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from .brdfs import BRDFs
from .effect import Array, Effect, Near, Numbers, Setting
from .situation import Situation


@dataclass(frozen=True)
class Fixed(Effect):
    """inner with the numbers x, which are no longer searched for."""

    inner: Effect
    x: NDArray[np.float64]
    cause = proof = ""

    @classmethod
    def of(cls, setting: Setting) -> Effect | None:
        return None

    def elsewhere(self, setting: Setting, near: Near) -> Fixed | None:
        inner = self.inner.elsewhere(setting, near)
        return None if inner is None else replace(self, inner=inner)

    @property
    def of_photo(self) -> bool:  # type: ignore[override]
        return self.inner.of_photo

    @property
    def blurs(self) -> bool:  # type: ignore[override]
        return self.inner.blurs

    @property
    def lights(self) -> bool:
        return self.inner.lights

    @property
    def numbers(self) -> Numbers:
        return Numbers.alike([], "", 1.0)

    def before(self, now: Situation, x: np.ndarray) -> Situation:
        return self.inner.before(now, self.x)

    def lamps(self, now: Situation, x: np.ndarray) -> list[Situation]:
        return self.inner.lamps(now, self.x)

    def added(self, now: Situation, brdfs: BRDFs, x: np.ndarray) -> Array | None:
        return self.inner.added(now, brdfs, self.x)

    def after(self, radiance: Array, now: Situation, x: np.ndarray) -> Array:
        return self.inner.after(radiance, now, self.x)

    def sentence(self, x: np.ndarray, deviation: np.ndarray) -> str:
        return self.inner.sentence(self.x, deviation)
