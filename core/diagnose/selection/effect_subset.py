"""The model with a subset of the accepted effects: a user can switch each of them off."""

from __future__ import annotations

from collections.abc import Collection, Mapping
from dataclasses import replace

from ..effects.camera_pose import CameraPose
from ..nuisances.pose_jitter import PoseJitter
from ..solver.gauss_newton import fit
from ..solver.model_fit import ModelFit
from .cross_validation import parameter_errors_by_photo, predict_held_out_regions
from .diagnosis import Diagnosis, Trial
from .held_out_error import held_out_errors
from .residual_structure import residual_structure

NO_CORRECTION = ("outside_basis", "second_material", "normal_error")
"""What the baseline measures itself: in the model already, or nothing that changes a sample."""


def correctable_effects(found: Diagnosis) -> tuple[Trial, ...]:
    """Accepted effects for which samples can be corrected."""
    return tuple(t for t in found.accepted if t.effect.cause not in NO_CORRECTION)


def with_causes(found: Diagnosis, causes: Collection[str]) -> ModelFit:
    """The model at its optimum with some of the accepted causes; if it lacks any of them, the
    parameters of the others are fitted again."""
    selected = [t for t in correctable_effects(found) if t.effect.cause in causes]
    ignored = {*NO_CORRECTION, *found.before.model.causes}  # what every scan gets wrong
    if set(found.after.model.causes) - ignored == {t.effect.cause for t in selected} - ignored:
        return found.after
    model = found.before.model
    if any(isinstance(trial.effect, CameraPose) for trial in selected):
        model = model.without_effect(PoseJitter.cause)
    for trial in selected:
        model = model.with_effect(trial.effect, trial.x)
    return fit(model, found.before.deviation)


def with_contradicted(
    found: Diagnosis, contradicted: Mapping[str, str], fitted: ModelFit | None = None
) -> Diagnosis:
    """The diagnosis with evidence against some causes (Diagnosis.contradicted). The other effects
    get the parameters of a fit without these; gains stay those in the full model. contradicted:
    cause → sentence. fitted: a fit with a subset of the causes, used if it is the required one."""
    if not contradicted:
        return found
    sound = {t.effect.cause for t in found.accepted}.difference(contradicted)
    after = with_causes(found if fitted is None else replace(found, after=fitted), sound)
    held_out, by_photo = predict_held_out_regions(after), parameter_errors_by_photo(after)

    def anew(trial: Trial) -> Trial:
        cause, model = trial.effect.cause, after.model
        if cause not in model.causes or model.is_frozen(cause):
            return trial
        return trial.in_fit(after, held_out.variance).with_photo_errors(by_photo)

    return replace(
        found,
        accepted=tuple(map(anew, found.accepted)),
        after=after,
        held_out_after=held_out,
        residual=residual_structure(after),
        error_after=held_out_errors(after, held_out, found.expected),
        contradicted={**found.contradicted, **contradicted},
    )
