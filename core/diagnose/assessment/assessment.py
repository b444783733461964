"""How far the joint fit of a diagnosis can be trusted, in four views."""

from __future__ import annotations

from dataclasses import dataclass

from ..selection.cross_validation import HeldOutPrediction
from ..solver.model_fit import ModelFit
from .calibration import Calibration
from .joint_parameters import JointParameters
from .sensor_residuals import SensorResiduals


@dataclass(frozen=True)
class Assessment:
    """parameters: estimates, correlations and impact. calibration: of the stated errors. sensor:
    residuals in the coordinates of the sensor."""

    parameters: JointParameters
    calibration: Calibration
    sensor: SensorResiduals

    @classmethod
    def of(cls, fit: ModelFit, held_out: HeldOutPrediction) -> Assessment:
        """fit: the last joint fit; held_out: its prediction of held-out regions."""
        return cls(JointParameters.of(fit), Calibration.of(fit, held_out), SensorResiduals.of(fit))
