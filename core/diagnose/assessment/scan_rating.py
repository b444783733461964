"""How good a scan is: each figure of its quality, rated as good, fair or poor."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

from ...fit.fit_quality import Rating
from ..selection.scan_quality import (
    GOOD_MATERIAL,
    GOOD_NORMALS,
    GOOD_POSES,
    UNUSUAL_MATERIAL,
    UNUSUAL_NORMALS,
    UNUSUAL_POSES,
)


@dataclass(frozen=True)
class RatedFigure:
    """One figure of the quality of a scan. label: its name. value: it with its unit. meaning: what
    it is. remedy: what a poor figure does, and what to do then."""

    label: str
    value: str
    rating: Rating
    meaning: str
    remedy: str


def rated_figures(quality: Mapping[str, Any]) -> list[RatedFigure]:
    """The figures of ``scan_quality`` in diagnosis.json. The variation of the albedo is left out:
    it is a property of the object."""
    found = []
    if quality["normals"] is not None:
        found.append(
            RatedFigure(
                "Normals",
                f"± {quality['normals']:.1f}°",
                _rated(quality["normals"], GOOD_NORMALS, UNUSUAL_NORMALS),
                "error of the mesh's normals",
                "Highlights come out too wide: reconstruct the mesh with more detail or less "
                "smoothing",
            )
        )
    found.append(
        RatedFigure(
            "Poses",
            f"± {quality['poses']:.1f} px",
            _rated(quality["poses"], GOOD_POSES, UNUSUAL_POSES),
            "displacement of the photos on the mesh",
            "Colours at edges are mixed: align the photos again, with more points in common",
        )
    )
    found.append(
        RatedFigure(
            "Material",
            f"{100 * quality['outside_basis']:.0f} %",
            _rated(quality["outside_basis"], GOOD_MATERIAL, UNUSUAL_MATERIAL),
            "difference from the measured materials that the fit knows",
            "The fit needs more photos, with lamps around the highlight and at grazing angles",
        )
    )
    return found


def _rated(value: float, good: float, unusual: float) -> Rating:
    """The rating of a figure that is better the smaller it is."""
    if value <= good:
        return Rating.GOOD
    return Rating.FAIR if value <= unusual else Rating.POOR
