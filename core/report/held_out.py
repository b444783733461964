"""How well the photos that were left out of a fit are predicted, with the variation if there is
one."""

from __future__ import annotations

from ..fit.fit_quality import FitQuality
from ..jobs import CaptureResult
from ..varying.varying_surface import EVEN


def varied_quality(result: CaptureResult) -> dict[str, FitQuality]:
    """Name of each material that varies over the surface → the quality with its variation."""
    if result.varying is None:
        return {}
    pairs = zip(result.materials, result.varying.materials, strict=True)
    return {
        material.name: FitQuality(kind.typical[kind.kind])
        for material, kind in pairs
        if kind.kind != EVEN and kind.kind in kind.typical
    }
