"""Effects with a few parameters for each of many patches, of the surface or of a photo."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Self

import numpy as np
from numpy.typing import NDArray

from ...forward.diagnosis_context import DiagnosisContext, NearestPixels
from .effect import Array, Effect, Vector
from .parameters import parameter_columns


@dataclass(frozen=True)
class PatchEffect(Effect):
    """patch: (n,) of each pixel, −1 none; prior: (e,) standard deviations of one patch's
    parameters. Its parameters follow patch by patch."""

    patch: NDArray[np.intp]
    prior: tuple[float, ...]

    def at_pixels(self, context: DiagnosisContext, nearest: NearestPixels) -> Effect:
        return replace(self, patch=self.patch[nearest.surface])

    @property
    def count(self) -> int:
        """Number of patches."""
        return int(self.patch.max()) + 1

    @property
    def parameter_index(self) -> NDArray[np.intp]:
        return parameter_columns(self.patch, len(self.parameters) // self.count)

    @property
    def deviation(self) -> Vector:
        """(count · e,) prior standard deviations of all parameters."""
        return np.tile(self.prior, self.count)

    def with_prior(self, prior: Vector) -> Self:
        """The effect with other prior standard deviations (e,) of one patch's parameters."""
        return replace(self, prior=tuple(prior.tolist()))

    def at_patch(self, x: Vector) -> Array:
        """(n, e) the parameters of each pixel's patch, float32."""
        values = x.reshape(-1, len(self.prior))[self.patch]
        return np.where(self.patch[:, None] >= 0, values, 0.0).astype(np.float32)
