"""Errors of the parameters of named causes against the truth of a capture."""

from __future__ import annotations

import numpy as np

from patina.core.diagnose.effects.black_level import BlackLevel
from patina.core.diagnose.forward.diagnosis_context import DiagnosisContext
from patina.core.diagnose.selection.trial import Trial

from ..hunt.judged import parameter_errors as parameter_errors_of_hunt
from .make import Truth

DISPLACEMENTS = 4  # parameters of a near lamp: towards the object, two to its sides, gain


def parameter_errors(trial: Trial, truth: Truth, context: DiagnosisContext) -> list[float]:
    """Return the errors of the parameters with a known true value, in standard errors.

    Vignetting, clipping and a second material have parameters without a true value of their own:
    the lens follows another curve, a plateau in 8-bit photos is known anyway, and a material is
    compared by its BRDF."""
    x, deviation = trial.identified, trial.standard_errors
    cause, known = trial.effect.cause, truth.parameters
    if cause == "near_light" and "displacement 1" in known:
        x, deviation = x[::DISPLACEMENTS], deviation[::DISPLACEMENTS]
        wanted = np.array([known[f"displacement {k + 1}"] for k in range(len(x))])
    elif cause == "flash_offset":
        wanted = np.array([known[way] for way in ("right", "down", "forward")])
    elif cause == "camera_response":
        # the second parameter, a bend, is 0 for a power curve
        wanted = np.array([known["gamma − 1"], 0.0])
    elif isinstance(trial.effect, BlackLevel):
        wanted = np.full(3, known["level"] / truth.white / trial.effect.white)
    elif cause == "ambient_light":
        scaled = {"radiance": known["radiance"] / truth.white}
        return parameter_errors_of_hunt(trial, scaled, context)
    else:
        return parameter_errors_of_hunt(trial, known, context)
    return [round(float(e), 2) for e in (x - wanted) / np.maximum(deviation, 1e-12)]
