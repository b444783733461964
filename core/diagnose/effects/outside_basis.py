"""The material reflects as no mixture of the measured ones does."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from .. import slack
from ..brdfs import BRDFs
from ..effect import Effect, Numbers, Setting


@dataclass(frozen=True)
class OutsideBasis(Effect):
    """No numbers of its own: the slack beside the basis may be large."""

    cause = "outside_basis"
    proof = "photos with light and camera at more angles to each other"

    @classmethod
    def of(cls, setting: Setting) -> OutsideBasis:
        return cls()

    @property
    def numbers(self) -> Numbers:
        return Numbers.alike([], "", 1.0)

    @property
    def freedom(self) -> int:
        return slack.COUNT

    def loosened(self, brdfs: BRDFs) -> BRDFs:
        variance = brdfs.variance.copy()
        variance[-slack.COUNT :] = slack.MUCH**2
        return replace(brdfs, variance=variance)

    def sentence(self, x: np.ndarray, deviation: np.ndarray) -> str:
        return (
            "the material is outside the basis: no mixture of the measured materials has its "
            "highlight; the fit bends them to it, and predicts directions that no photo saw less "
            "surely"
        )
