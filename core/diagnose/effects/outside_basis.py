"""A material outside the basis: no mixture of the measured materials reflects like it."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from .base.unusual_scan import UnusualScan


@dataclass(frozen=True)
class OutsideBasis(UnusualScan):
    """measured: RMS of ln of the factor by which the material differs from the basis."""

    cause = "outside_basis"
    deciding_photo = "photos with light and camera at more angles to each other"

    def sentence(self, x: np.ndarray, error: np.ndarray) -> str:
        return (
            "This material reflects unlike any mixture of the measured materials: by "
            f"{100 * self.measured[0]:.0f} % (RMS). The fit approximates it; predictions for "
            "directions that no photo shows are less certain."
        )
