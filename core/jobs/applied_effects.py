"""An effect that a fitted material takes into account."""

from __future__ import annotations

from dataclasses import dataclass


@dataclass(frozen=True)
class AppliedEffect:
    """cause: of the vocabulary; sentence: for an artist; names, units, numbers: (p,) its
    parameters, with their standard errors."""

    cause: str
    sentence: str
    names: tuple[str, ...]
    units: tuple[str, ...]
    numbers: tuple[float, ...]
    errors: tuple[float, ...]
