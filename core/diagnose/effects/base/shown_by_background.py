"""Effects that change the background of the photos too, where the object is not."""

from __future__ import annotations

from abc import ABC, abstractmethod

import numpy as np

from ...forward.diagnosis_context import DiagnosisContext
from .effect import Array, Effect, Vector

TOLERANCE = 0.25  # relative: of the background, which compression and noise change
MIN_SHOWING = 0.5  # of the photos; stray light of the lamp may brighten the background of others


class ShownByBackground(Effect, ABC):
    """What an effect adds to the dark background is not brighter than the background.

    background: (k, 3, 3) of each photo that shows a background: its radiance, the photo under a
    wide blur there, and the mean of the photo, as of pixels/background.py.
    """

    background: Array

    @abstractmethod
    def in_background(self, x: Vector) -> Array:
        """(k, 3) radiance that the effect adds to the dark background of each photo."""

    def is_shown(self, x: Vector) -> bool:
        """Whether the background is what the parameters x predict: darker in no photo, and brighter
        in half of them at most."""
        predicted = self.in_background(x).mean(axis=1)
        if not len(predicted) or predicted.min() <= 0:
            return False
        ratio = self.background[:, 0].mean(axis=1) / predicted
        return bool(ratio.min() > 1 - TOLERANCE and np.mean(ratio < 1 + TOLERANCE) >= MIN_SHOWING)


def known_backgrounds(context: DiagnosisContext) -> Array:
    """(k, 3, 3) of the photos that show a background."""
    _, first = np.unique(context.pixels.photo, return_index=True)
    background = context.pixels.background[first]
    return np.asarray(background[np.isfinite(background).all(axis=(1, 2))])
