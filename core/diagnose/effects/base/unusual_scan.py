"""Causes that the baseline of a diagnosis measures itself: a scan or surface that is worse than
usual.

Every scan is a little wrong everywhere, and every surface varies. This is in the model of every
diagnosis (core/diagnose/nuisances) and reported as the quality of the scan. It is named as a cause
only where it is beyond what scans usually have.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Self

from ...forward.diagnosis_context import DiagnosisContext, NearestPixels
from .effect import Effect
from .parameters import Parameters


@dataclass(frozen=True)
class UnusualScan(Effect):
    """No parameters of its own. measured: numbers for the sentence."""

    measured: tuple[float, ...]

    @classmethod
    def of(cls, context: DiagnosisContext) -> Self | None:
        return None

    def at_pixels(self, context: DiagnosisContext, nearest: NearestPixels) -> None:
        return None

    @property
    def parameters(self) -> Parameters:
        return Parameters.alike([], "", 1.0)
