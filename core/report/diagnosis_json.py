"""diagnosis.json: the causes found for a capture, with evidence and errors before and after."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ..diagnose.assessment.assessment import Assessment
from ..diagnose.assessment.calibration import BINS, CONFIDENCE, INTERVAL
from ..diagnose.effects.actions import ACTIONS
from ..diagnose.forward.diagnosis_context import DiagnosisContext
from ..diagnose.selection.diagnosis import Diagnosis, Trial
from ..diagnose.selection.held_out_error import HeldOutErrors
from ..jobs import CaptureResult
from .diagnosis import evidence_file
from .result_json import parameters, program_version

FORMAT = 3


@dataclass(frozen=True)
class CheckRecord:
    """A diagnosis, to be stored with its result. description: the content of diagnosis.json."""

    description: dict[str, Any]
    found: Diagnosis
    context: DiagnosisContext


def describe(
    found: Diagnosis, assessment: Assessment, before: CaptureResult, after: CaptureResult
) -> dict[str, Any]:
    """The content of diagnosis.json. assessment: of the last joint fit. before, after: the fits
    without and with a correction for the named causes. Gains are in nats, angles in radians. Errors
    of materials are relative errors of held-out photos: held_out the RMS, typical the median over
    pixels."""
    tried = {t.effect.cause for trials in found.rounds for t in trials}
    return {
        "format": FORMAT,
        "program": {"name": "patina", "version": program_version()},
        "capture": str(before.capture.file),
        "named": list(found.causes) or ["none"],
        "baseline": _errors(found.error_before),
        "extended": _errors(found.error_after),
        "causes": [_cause(t, found) for t in found.ranked],
        "scan_quality": {**found.quality.figures(), "sentence": found.quality.sentence()},
        "assessment": _assessment(assessment),
        "unexplained": found.unexplained,
        "left": {
            "gain": found.residual.gain,
            "standard_error": found.residual.error,
            "rms": found.residual.change,
            "sentence": found.unexplained_sentence,
        },
        "applied": [effect.cause for effect in after.effects],
        "materials": [
            {
                "name": one.name,
                "coefficients_before": one.fit.brdf.coefficients.tolist(),
                "coefficients_after": other.fit.brdf.coefficients.tolist(),
                "held_out_before": None if one.held_out is None else one.held_out.error,
                "held_out_after": None if other.held_out is None else other.held_out.error,
                "typical_before": None if one.held_out is None else one.held_out.typical,
                "typical_after": None if other.held_out is None else other.held_out.typical,
            }
            for one, other in zip(before.materials, after.materials, strict=True)
        ],
        "tried": sorted(tried),
    }


def _assessment(assessment: Assessment) -> dict[str, Any]:
    """How far the joint fit can be trusted. Parameters are in their own units, residuals relative
    to the prediction; cells of the sensor without pixels are null."""
    joint, calibration, sensor = assessment.parameters, assessment.calibration, assessment.sensor
    each = zip(
        joint.cause, joint.name, joint.estimate, joint.error, joint.prior, joint.pull, strict=True
    )
    keys = ("cause", "name", "estimate", "standard_error", "prior", "pull")
    return {
        "parameters": [
            dict(zip(keys, (c, n, *map(float, values)), strict=True)) for c, n, *values in each
        ],
        "correlation": np.round(joint.correlation, 3).tolist(),
        "confusable": [{"causes": [a, b], "correlation": r} for a, b, r in joint.confusable],
        "impact": dict(joint.ranked),
        "calibration": {
            "bins": BINS,
            "density": calibration.density.tolist(),
            "low": calibration.low.tolist(),
            "high": calibration.high.tolist(),
            "confidence": CONFIDENCE,
            "interval": INTERVAL,
            "covered": calibration.covered,
            "calibrated": calibration.is_calibrated,
        },
        "sensor": {
            "mean": _cells(sensor.mean),
            "standard_error": _cells(sensor.error),
            "half_width": sensor.width,
            "half_height": sensor.height,
            "significant": sensor.significant,
        },
    }


def _cells(values: NDArray[np.float64]) -> list[list[float | None]]:
    """Rows of a grid, null where a value is not known."""
    return [[float(v) if np.isfinite(v) else None for v in row] for row in values]


def _errors(error: HeldOutErrors) -> dict[str, float | None]:
    """Errors of held-out regions and photos (HeldOutErrors)."""
    return {
        "held_out": error.parts,
        "held_out_photos": error.photos,
        "held_out_over_noise_floor": error.over_floor,
        "not_noise": error.not_noise,
    }


def _cause(trial: Trial, found: Diagnosis) -> dict[str, Any]:
    declared = trial.effect.parameters
    accepted = trial in found.accepted
    has_evidence = trial in found.named and len(declared) > 0
    return {
        "cause": trial.effect.cause,
        "accepted": accepted,
        "contradicted": found.contradicted.get(trial.effect.cause),
        "sentence": found.sentence(trial),
        "action": ACTIONS[trial.effect.cause],
        "ties": [effect.cause for effect in trial.ties],
        "held_out_gain": trial.gain,
        "standard_error": trial.error,
        "p_value": trial.p_value,
        "rms_change": trial.change,
        "evidence": f"report/{evidence_file(trial.effect.cause)}" if has_evidence else None,
        "parameters": parameters(
            declared.names, declared.units, trial.identified, trial.standard_errors
        ),
    }
