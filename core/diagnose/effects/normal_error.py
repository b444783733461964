"""Errors of the mesh's normals beyond those of a usual scan: it is too smooth, or noisy."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from .base.unusual_scan import UnusualScan


@dataclass(frozen=True)
class NormalError(UnusualScan):
    """measured: degrees by which the normals of patches are off, RMS."""

    cause = "normal_error"
    deciding_photo = "a closer scan of a part of the surface"

    def sentence(self, x: np.ndarray, error: np.ndarray) -> str:
        return (
            f"The normals of the mesh are off by {self.measured[0]:.1f}° (RMS over patches). The "
            "mesh is too smooth or noisy."
        )
