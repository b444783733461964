"""Surface bumps that the mesh lacks, estimated patch by patch, and the basis slack; both must not
be confused with albedo.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from patina.core.basis import PrincipalBRDF, default_basis
from patina.core.diagnose.forward import basis_slack
from patina.core.diagnose.forward.diagnosis_context import DiagnosisContext
from patina.core.diagnose.forward.material_brdfs import MaterialBRDFs
from patina.core.diagnose.forward.shading_state import ShadingState
from patina.core.diagnose.nuisances.surface_variation import SurfaceVariation
from patina.core.diagnose.selection.baseline import fit_baseline
from patina.core.diagnose.selection.scan_quality import ScanQuality
from patina.core.diagnose.selection.unusual_scan import unusual_causes, with_unusual_normals
from patina.core.diagnose.solver.gauss_newton import fit
from patina.core.diagnose.solver.model import Model
from patina.core.diagnose.solver.residual_scale import expected_deviation
from tests.make_lit_ball import NOISE, changed, lit_ball

BUMP_TILT = np.radians(6.0)


def bumpy(seed: int, wide: float) -> tuple[DiagnosisContext, np.ndarray]:
    """A ball with round bumps that its mesh does not have: photos of it, and its normals (n, 3).
    wide: width of a bump in scan units.
    """
    context = lit_ball(seed)
    pixels = context.pixels
    slope = BUMP_TILT * np.sin(2 * np.pi * pixels.point / wide)
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


def test_patch_normals_recover_bumps_a_few_patches_wide():
    """The normals' error falls to a third of the mesh's own; flat patches, which only tilt, leave
    more.
    """
    context, normal = bumpy(1, 0.4)
    effect = SurfaceVariation.of(context)
    tilts, bends, rest = (2 * BUMP_TILT / 3,) * 2, BUMP_TILT / 3, (1e-4,) * 5
    left = {}
    for way, stiff in (("bent", 1.0), ("flat", 1e-4)):
        usual = (*tilts, *(stiff * bends,) * 3, *rest)
        model = Model(context.pixels, context.brdfs).with_effect(replace(effect, prior=usual))
        fitted = fit(model, deviation_of(context))
        found = fitted.model.shading().normal
        errors = np.linalg.norm(np.cross(found, normal), axis=1)
        known = effect.patch >= 0
        left[way] = np.sqrt(np.mean(errors[known] ** 2))
    scan = np.linalg.norm(np.cross(context.pixels.normal, normal), axis=1)
    before = np.sqrt(np.mean(scan[effect.patch >= 0] ** 2))
    assert left["bent"] < before / 3
    assert left["bent"] < 0.8 * left["flat"]


def test_deep_bumps_are_named_as_unusual_normals_and_not_as_albedo():
    context, _ = bumpy(2, 0.5)
    baseline = fit_baseline(context, np.radians(0.2), 12)
    found = with_unusual_normals(baseline.fitted, ScanQuality.of(baseline.fitted))
    (trial,) = unusual_causes(baseline.plain, found, ScanQuality.of(found))
    assert trial.effect.cause == "normal_error"
    assert ScanQuality.of(found).albedo < 0.08


def test_paint_on_a_part_of_the_surface_is_a_second_material():
    """A part of the ball reflects half as much. Stains that vary smoothly are none."""
    context = replace(lit_ball(2), size=2.0)
    part = context.pixels.point[:, 0] > 0.33
    painted = changed(context, np.where(part[:, None], 0.5, 1.0) * context.pixels.observed)
    baseline = fit_baseline(painted, np.radians(0.2), 12)
    (trial,) = unusual_causes(baseline.plain, baseline.fitted, ScanQuality.of(baseline.fitted))
    assert trial.effect.cause == "second_material"
    share, factor = trial.effect.measured
    assert share == pytest.approx(part.mean(), rel=0.3) and -0.6 < factor < -0.4
    stains = np.exp(0.15 * np.sin(5 * context.pixels.point.sum(axis=1)))[:, None]
    baseline = fit_baseline(
        changed(context, stains * context.pixels.observed), np.radians(0.2), 12
    )  # fmt: skip
    assert unusual_causes(baseline.plain, baseline.fitted, ScanQuality.of(baseline.fitted)) == []


def test_white_lambertian_wall_needs_little_slack():
    """Lambert's law at three times the albedo of the brightest measured material: the remaining
    basis slack has a small magnitude.
    """
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
    slack_coefficients = fitted.model.brdfs.coefficients[..., -basis_slack.COUNT :]
    # 0.46 where the basis functions must make it brighter, too
    assert np.abs(slack_coefficients).max() < 0.2
