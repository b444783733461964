"""Light bounced from one part of the object to another."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ..brdfs import BRDFs
from ..effect import Array, Effect, Numbers, Setting
from ..situation import Situation


@dataclass(frozen=True)
class Interreflection(Effect):
    """numbers: the bounced light over what one bounce of the fitted materials gives. reflected:
    (n, 3) that bounce."""

    reflected: Array
    cause = "interreflection"
    proof = "one photo with a black cloth over the parts that face the bright ones"

    @classmethod
    def of(cls, setting: Setting) -> Interreflection | None:
        around = setting.surroundings
        if not (around.face >= 0).any():
            return None
        reflected = np.zeros((len(setting.pixels), 3), np.float32)
        for photo in np.unique(setting.pixels.photo):
            rows = np.flatnonzero(setting.pixels.photo == photo)
            glow = setting.glow(int(photo))  # (f, 3) radiance of every face, 0 in shadow
            face = around.face[rows]
            seen = np.where((face >= 0)[..., None], glow[np.maximum(face, 0)], 0)
            reflected[rows] = np.einsum("ndc,ndc->nc", around.reflected[rows], seen)
        return cls(reflected)

    @property
    def numbers(self) -> Numbers:
        return Numbers.alike(["bounce"], "of one", 0.7, 0.0, 3.0, step=1e-2)

    def added(self, now: Situation, brdfs: BRDFs, x: np.ndarray) -> Array:
        return self.reflected * x[0]

    def sentence(self, x: np.ndarray, deviation: np.ndarray) -> str:
        most = 100 * float(np.percentile(x[0] * self.reflected.mean(axis=1), 99))
        return (
            "light bounced from one part of the object to another: folds are brighter than the "
            f"lamp makes them ({x[0]:.1f} times what one bounce of the fitted material gives; up "
            f"to {most:.2g} in units of 1/100 radiance)"
        )
