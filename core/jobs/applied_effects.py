"""An effect for which a fitted material was corrected."""

from __future__ import annotations

from dataclasses import dataclass


@dataclass(frozen=True)
class AppliedEffect:
    """cause: its name in the vocabulary of causes. sentence: for the user. names, units, numbers:
    (p,) of its parameters; errors: (p,) their standard errors."""

    cause: str
    sentence: str
    names: tuple[str, ...]
    units: tuple[str, ...]
    numbers: tuple[float, ...]
    errors: tuple[float, ...]
