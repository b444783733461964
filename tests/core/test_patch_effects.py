"""Bumps that the mesh does not have, patch by patch, and what is not to be taken for them; what
is a little outside the basis."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from patina.core.basis import PrincipalBRDF, default_basis
from patina.core.diagnose.effects.normal_error import NormalError
from patina.core.diagnose.effects.second_material import SecondMaterial
from patina.core.diagnose.forward import basis_slack
from patina.core.diagnose.forward.diagnosis_context import DiagnosisContext
from patina.core.diagnose.forward.material_brdfs import MaterialBRDFs
from patina.core.diagnose.forward.shading_state import ShadingState
from patina.core.diagnose.selection import effect_trials
from patina.core.diagnose.selection.significance import Candidate
from patina.core.diagnose.selection.trial import MIN_STANDARD_ERRORS
from patina.core.diagnose.solver.gauss_newton import fit
from patina.core.diagnose.solver.model import Model
from patina.core.diagnose.solver.residual_scale import expected_deviation
from tests.make_lit_ball import NOISE, changed, lit_ball

DEEP = np.radians(6.0)


def bumpy(seed: int, wide: float) -> tuple[DiagnosisContext, np.ndarray]:
    """A ball with round bumps that its mesh does not have: photos of it, and its normals (n, 3).
    wide: of a bump, scan units."""
    context = lit_ball(seed)
    pixels = context.pixels
    slope = DEEP * np.sin(2 * np.pi * pixels.point / wide)
    slope -= np.sum(slope * pixels.normal, axis=1, keepdims=True) * pixels.normal
    normal = pixels.normal + slope
    normal /= np.linalg.norm(normal, axis=1, keepdims=True)
    now = replace(ShadingState.of(pixels), normal=normal)
    rho = context.brdfs.evaluate(now.angles, pixels.material)
    light = np.pi * np.maximum(np.sum(normal * pixels.light, axis=1, keepdims=True), 0)
    noise = 1 + NOISE * np.random.default_rng(seed).standard_normal(rho.shape)
    return changed(replace(context, size=2.0), rho * light * noise), normal


def deviation_of(context: DiagnosisContext) -> np.ndarray:
    return expected_deviation(context.pixels, context.brdfs, np.radians(0.2))


def test_patches_follow_bumps_that_are_as_wide_as_a_few_of_them():
    """Normals are found to a third of what the mesh is off by; flat patches, which only tilt, leave
    more."""
    context, normal = bumpy(1, 0.4)
    effect = NormalError.of(context)
    left = {}
    for way, stiff in (("bent", 1.0), ("flat", 1e-4)):
        usual = (*effect.prior[:2], *(stiff * u for u in effect.prior[2:]))
        model = Model(context.pixels, context.brdfs).with_effect(replace(effect, prior=usual))
        fitted = fit(model, deviation_of(context))
        found = fitted.model.shading().normal
        missed = np.linalg.norm(np.cross(found, normal), axis=1)
        known = effect.patch >= 0
        left[way] = np.sqrt(np.mean(missed[known] ** 2))
    scan = np.linalg.norm(np.cross(context.pixels.normal, normal), axis=1)
    before = np.sqrt(np.mean(scan[effect.patch >= 0] ** 2))
    assert left["bent"] < before / 3
    assert left["bent"] < 0.8 * left["flat"]


def test_bumps_are_not_taken_for_paint_as_well():
    """Beside patches that are accepted, other patches are judged against a model that knows the
    first ones in left-out squares, too: else all that they stand for is gained twice, 16,000 nats
    here for paint that is not there."""
    context, _ = bumpy(2, 0.5)
    model = Model(context.pixels, context.brdfs).with_effect(NormalError.of(context))
    now = fit(model, deviation_of(context))
    paint = effect_trials.try_effect(
        now, effect_trials.held_out_costs(now), Candidate(SecondMaterial.of(context), 0.0, 0.0)
    )
    assert paint.gain < MIN_STANDARD_ERRORS * paint.error
    assert not paint.is_accepted


def test_a_white_wall_is_hardly_outside():
    """Lambert's law at three times the albedo of the brightest measured material: the slack that
    is left for it is a shape, and small."""
    context = lit_ball(3)
    pixels, basis = context.pixels, default_basis()
    light = np.maximum(np.sum(pixels.normal * pixels.light, axis=1, keepdims=True), 0)
    noise = NOISE * np.random.default_rng(0).standard_normal((len(pixels), 3))
    observed = 0.95 * light * (1 + noise)
    brightest = PrincipalBRDF(basis, basis.training[3 * 84 : 3 * 84 + 3])
    known = replace(pixels, noise=np.square(NOISE * 0.95 * light * np.ones(3)))
    context = replace(context, pixels=known, brdfs=MaterialBRDFs.of([brightest]))
    context = changed(context, observed)
    fitted = fit(Model(context.pixels, context.brdfs), deviation_of(context))
    assert np.median(np.abs(fitted.predicted / observed - 1)) < 1.5 * NOISE
    hats = fitted.model.brdfs.coefficients[..., -basis_slack.COUNT :]
    assert np.abs(hats).max() < 0.2  # 0.46 where the hats have to make it brighter, too
