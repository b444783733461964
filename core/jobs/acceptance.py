"""The decision whether a second fit is rejected.

A model can explain the photos that it was fitted to by a cause that is not present. It then
predicts held-out photos worse than the model without that cause."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from ..diagnose.selection.diagnosis import Diagnosis
from ..diagnose.selection.held_out_error import held_out_photo_error
from ..diagnose.solver.model_fit import ModelFit
from ..fit.held_out import HeldOutErrors
from .fit_job import MaterialResult

MAX_LOG_GROWTH = 0.03  # ln of the factor by which the errors of held-out photos may grow
MAX_LOG_GROWTH_OF_FIT = 0.1  # the same for the second fit alone, whatever the joint fit gains


@dataclass(frozen=True)
class Rejection:
    """evidence: a sentence with the evidence against a second fit. of_cause: whether it is evidence
    against the cause as well. If not, the cause is present, but the correction does not improve the
    materials: the shape of a highlight cannot be measured under a lamp as wide as the highlight.
    What predicts held-out photos better in the joint fit is present."""

    evidence: str
    of_cause: bool


@dataclass(frozen=True)
class Refit:
    """A material's second fit. material: None where it could not be fitted. light: photo → RMS
    radiance of the lamp's light on its samples divided by the RMS of their whole radiance
    (CorrectedSamples.light). warnings: sentences. blurred: whether its highlights are still as wide
    as in the photos."""

    material: MaterialResult | None
    light: Mapping[int, float]
    warnings: tuple[str, ...]
    blurred: bool = False


def joint_log_growth(found: Diagnosis, fitted: ModelFit) -> float:
    """ln of the factor by which the RMS error of held-out photos grows if the materials and all
    causes are fitted together; 0 if there is only one photo. fitted: with the causes that the
    second fit takes into account."""
    before = found.error_before.photos
    known = fitted is found.after
    after = found.error_after.photos if known else held_out_photo_error(fitted)
    return 0.0 if before is None or after is None else log_growth(before, after)


def evidence_against(
    before: Sequence[MaterialResult], after: Sequence[Refit], jointly: float = 0.0
) -> Rejection | None:
    """The evidence against second fits that predict held-out photos worse; None: accepted.

    before, after: first and second fits of the materials. Each photo is compared with itself, and
    all have the same weight; otherwise the photo with the largest error would decide. Both errors
    are relative to the whole radiance of a photo, because a correction (of a steep tone curve, for
    example) changes the radiance of its samples. jointly: ln of the growth of the error if
    materials and causes are fitted together (joint_log_growth); it is added because the errors of
    the separate fits vary by a few percent by chance if there are only eight photos.
    """
    judged = [
        (one.name, mean_photo_errors(one.held_out, other.material.held_out, other.light))
        for one, other in zip(before, after, strict=True)
        if other.material is not None
        and one.held_out is not None
        and other.material.held_out is not None
    ]
    errors = {name: each for name, each in judged if each is not None}
    growths = [log_growth(*each) for each in errors.values()]
    mean = float(np.mean(growths)) if growths else -np.inf
    worse = mean + jointly > MAX_LOG_GROWTH
    if not worse and mean < MAX_LOG_GROWTH_OF_FIT:
        return None
    return Rejection(_evidence(errors, jointly), worse and jointly > -MAX_LOG_GROWTH)


def _evidence(errors: Mapping[str, tuple[float, float]], jointly: float) -> str:
    """A sentence on the errors of held-out photos: by material (before, after), and in the joint
    fit. Each verb is chosen from the numbers as they are printed."""
    changes = ", ".join(f"{_change(*each)} for {name}" for name, each in errors.items())
    percent = round(100 * float(np.expm1(jointly)))
    if not percent:
        joint = ""
    else:
        verb = "increases" if percent > 0 else "decreases"
        joint = (
            "; if materials and causes are fitted together, the RMS error over all held-out photos "
            f"{verb} by {abs(percent)} %"
        )
    return (
        "With this cause, the RMS error of held-out photos (geometric mean over photos) "
        f"{changes}{joint}."
    )


def _change(before: float, after: float) -> str:
    """A relative error before and after, in words; small ones with more digits."""
    digits = 1 if before >= 0.1 else 2
    first, last = (f"{100 * error:.{digits}f} %" for error in (before, after))
    if first == last:
        return f"stays at {first}"
    return f"{'increases' if after > before else 'decreases'} from {first} to {last}"


def mean_photo_errors(
    before: HeldOutErrors, after: HeldOutErrors, light: Mapping[int, float] | None = None
) -> tuple[float, float] | None:
    """Geometric means over photos of their relative RMS errors (before, after); None where no photo
    has both. light: Refit.light of the second fit, which makes its errors relative to the whole
    radiance of the photos; None: they are already."""
    if light is None:
        light = dict.fromkeys(after.per_photo, 1.0)
    photos = sorted(before.per_photo.keys() & after.per_photo.keys() & light.keys())
    if not photos:
        return None
    both = [(before.per_photo[p], after.per_photo[p] * light[p]) for p in photos]
    first, second = np.exp(np.mean(np.log(np.maximum(both, 1e-9)), axis=0))
    return float(first), float(second)


def log_growth(before: float, after: float) -> float:
    """ln of the factor by which an error grew."""
    return float(np.log(max(after, 1e-9) / max(before, 1e-9)))
