"""A second material: a part of the surface is brighter, darker or of another colour than usual
variation."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from .base.unusual_scan import UnusualScan


@dataclass(frozen=True)
class SecondMaterial(UnusualScan):
    """measured: share of the surface that differs, and its relative reflectance."""

    cause = "second_material"
    deciding_photo = "a mask of the part that looks different, painted in one photo"

    def sentence(self, x: np.ndarray, error: np.ndarray) -> str:
        share, factor = self.measured
        return (
            f"There is more than one material: {100 * share:.0f} % of the surface differs from the "
            f"rest, by {100 * factor:+.0f} % in reflectance on average. Paint a mask of this part."
        )
