"""Light bounced from one part of the object to another."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace

import numpy as np

from ..brdfs import BRDFs
from ..effect import Array, Effect, Near, Numbers, Setting
from ..situation import Situation
from ..surroundings import ACCURACY


@dataclass(frozen=True)
class Interreflection(Effect):
    """numbers: the bounced light over what the fitted materials bounce. reflected: (n, 3) that
    light; glow: by photo, (f, 3) what every face of the mesh sends off."""

    reflected: Array
    glow: dict[int, Array]
    cause = "interreflection"
    of_brdf = True
    accuracy = ACCURACY
    proof = "one photo with a black cloth over the parts that face the bright ones"

    @classmethod
    def of(cls, setting: Setting) -> Interreflection | None:
        if not (setting.surroundings.face >= 0).any():
            return None
        glow = {int(photo): setting.glow(int(photo)) for photo in np.unique(setting.pixels.photo)}
        return cls(_bounced(setting, glow), glow)

    def elsewhere(self, setting: Setting, near: Near) -> Interreflection:
        return replace(self, reflected=_bounced(setting, self.glow))

    @property
    def numbers(self) -> Numbers:
        return Numbers.alike(["bounce"], "of one", 0.7, 0.0, 3.0, step=1e-2)

    def added(self, now: Situation, brdfs: BRDFs, x: np.ndarray) -> Array:
        return self.reflected * x[0]

    def sentence(self, x: np.ndarray, deviation: np.ndarray) -> str:
        most = 100 * float(np.percentile(x[0] * self.reflected.mean(axis=1), 99))
        return (
            "light bounced from one part of the object to another: folds are brighter than the "
            f"lamp makes them ({x[0]:.1f} times what the fitted material would bounce; up "
            f"to {most:.2g} in units of 1/100 radiance)"
        )


def _bounced(setting: Setting, glow: Mapping[int, Array]) -> Array:
    """(n, 3) reflected of what the faces that each pixel sees send off, 0 in shadow."""
    around, pixels = setting.surroundings, setting.pixels
    reflected = np.zeros((len(pixels), 3), np.float32)
    for photo in np.unique(pixels.photo):
        rows = np.flatnonzero(pixels.photo == photo)
        face = around.face[rows]
        seen = np.where((face >= 0)[..., None], glow[int(photo)][np.maximum(face, 0)], 0)
        reflected[rows] = np.einsum("ndc,ndc->nc", around.reflected[rows], seen)
    return reflected
