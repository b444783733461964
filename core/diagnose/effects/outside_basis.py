"""A material outside the basis: no mixture of the measured materials reflects like it."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from ..forward import basis_slack
from ..forward.diagnosis_context import DiagnosisContext
from ..forward.material_brdfs import MaterialBRDFs
from .base.capabilities import RelaxesBRDFs
from .base.parameters import Parameters


@dataclass(frozen=True)
class OutsideBasis(RelaxesBRDFs):
    """No parameters of its own: the prior of the additional basis functions (basis_slack.py) is
    widened."""

    cause = "outside_basis"
    deciding_photo = "photos with light and camera at more angles to each other"

    @classmethod
    def of(cls, context: DiagnosisContext) -> OutsideBasis:
        return cls()

    @property
    def parameters(self) -> Parameters:
        return Parameters.alike([], "", 1.0)

    @property
    def degrees_of_freedom(self) -> int:
        return basis_slack.COUNT

    def relaxed(self, brdfs: MaterialBRDFs) -> MaterialBRDFs:
        variance = brdfs.variance.copy()
        variance[-basis_slack.COUNT :] = basis_slack.WIDE_SCALE**2
        return replace(brdfs, variance=variance)

    def sentence(self, x: np.ndarray, error: np.ndarray) -> str:
        return (
            "This material's highlight is unlike any mixture of the measured materials. The fit "
            "approximates it; predictions for directions that no photo shows are less "
            "certain."
        )
