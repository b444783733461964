"""The material reflects as no mixture of the measured ones does."""

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
    """No numbers of its own: the slack beside the basis may be large."""

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
        variance[-basis_slack.COUNT :] = basis_slack.MUCH**2
        return replace(brdfs, variance=variance)

    def sentence(self, x: np.ndarray, error: np.ndarray) -> str:
        return (
            "the material is outside the basis: no mixture of the measured materials has its "
            "highlight; the fit bends them to it, and predicts directions that no photo saw less "
            "surely"
        )
