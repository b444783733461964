"""The frames of surface patches, in which their normals are tilted and bent."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from ....angles.vectors import tangents
from ...forward.diagnosis_context import DiagnosisContext
from .effect import Array
from .surface_patches import mean_of

MAX_PLACE = 1.5  # half widths: a pixel outside its nearest patch does not extrapolate the curvature


@dataclass(frozen=True)
class PatchFrames:
    """first, other: (n, 3) tangents of the mean normal of each pixel's patch; middle: (P, 3) centre
    of each patch; place: (n, 2) position of a pixel relative to it, along both tangents, in half
    widths; width: of a patch, scan units."""

    first: Array
    other: Array
    middle: Array
    place: Array
    width: float

    @classmethod
    def of(cls, context: DiagnosisContext, patch: NDArray[np.intp], width: float) -> PatchFrames:
        """patch: (n,) number of each pixel's patch, −1 none; some pixel has one."""
        mean = mean_of(patch, context.pixels.normal)
        mean /= np.maximum(np.linalg.norm(mean, axis=1, keepdims=True), 1e-9)
        first, other = (v[patch].astype(np.float32) for v in tangents(mean))
        middle = mean_of(patch, context.pixels.point)
        return cls(first, other, middle, _place(context, middle[patch], first, other, width), width)

    def at_pixels(
        self, context: DiagnosisContext, nearest: NDArray[np.intp], patch: NDArray[np.intp]
    ) -> PatchFrames:
        """For other pixels, those of ``context``. nearest: (m,) index of the nearest pixel before;
        patch: (m,) of each."""
        first, other = self.first[nearest], self.other[nearest]
        place = _place(context, self.middle[patch], first, other, self.width)
        return replace(self, first=first, other=other, place=place)

    def tilted(self, normal: Array, first: Array, second: Array, bends: Sequence[Array]) -> Array:
        """(n, 3) unit normals. first, second: (n,) tangents of the angles along ``first`` and
        ``other``; bends: three (n,), their changes over half a patch: of the first along first, of
        each along the other's direction, of the second along other."""
        u, v = self.place.T
        along, across, aside = bends
        tilt = np.stack([first + along * u + across * v, second + across * u + aside * v], axis=1)
        normal = normal + tilt[:, :1] * self.first + tilt[:, 1:] * self.other
        normal /= np.linalg.norm(normal, axis=1, keepdims=True)
        return normal


def _place(
    context: DiagnosisContext, middle: Array, first: Array, other: Array, width: float
) -> Array:
    """(n, 2) positions of the context's pixels relative to the centres (n, 3) of their patches, in
    half widths."""
    away = (context.pixels.point - middle) / (0.5 * width)
    place = np.stack([np.sum(away * along, axis=1) for along in (first, other)], axis=1)
    return np.clip(place, -MAX_PLACE, MAX_PLACE).astype(np.float32)
