"""How good a fit is, in a word: good, fair or poor, by its error on held-out photos."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from enum import Enum
from typing import Any

# of linear light, in which errors are about twice those of the encoded photo that a viewer shows
MAX_GOOD_ERROR = 0.10  # typical error of a held-out photo; even materials under known lamps: 2–8 %
MAX_FAIR_ERROR = 0.25  # telephone photos of an even box: 20 %; one BRDF on a patinated bronze: 39 %


class Rating(Enum):
    """A word for the error."""

    GOOD = "good"
    FAIR = "fair"
    POOR = "poor"
    NOT_RATED = "not rated"


@dataclass(frozen=True)
class FitQuality:
    """typical: median |L̂ − L| / L of held-out photos; None where no photo was held out."""

    typical: float | None

    @classmethod
    def of_result(
        cls, material: Mapping[str, Any], varying: Mapping[str, Any] | None = None
    ) -> FitQuality:
        """Of a material of result.json, also of one that an earlier version wrote. varying: the
        entry of that name in result.json; photos of a material that varies are predicted with its
        variation."""
        for entry in (varying or {}).get("materials", []):
            kind, typical = entry["varies"], entry["held_out_typical"]
            if entry["name"] == material["name"] and kind != "even" and kind in typical:
                return cls(typical[kind])
        held = material.get("held_out")
        return cls(held["typical"] if held else None)

    @property
    def rating(self) -> Rating:
        """The word."""
        if self.typical is None:
            return Rating.NOT_RATED
        if self.typical <= MAX_GOOD_ERROR:
            return Rating.GOOD
        return Rating.FAIR if self.typical <= MAX_FAIR_ERROR else Rating.POOR

    @property
    def sentence(self) -> str:
        """For the user."""
        if self.typical is None:
            return "Not rated: no photo was held out; two photos or more are needed"
        percent = 100 * self.typical
        shown = f"{percent:.0f}" if percent >= 9.5 else f"{percent:.1f}"
        return f"Typical error of a held-out photo: {shown} % ({self.rating.value})"
