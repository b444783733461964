"""Damped steps where a Gauss–Newton step fails."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from patina.core.basis import PrincipalBRDF, default_basis
from patina.core.basis.training import DEFAULT_COUNT
from patina.core.diagnose.effects.light_intensity import LightIntensity
from patina.core.diagnose.forward.material_brdfs import MaterialBRDFs
from patina.core.diagnose.selection.baseline import fit_baseline
from patina.core.diagnose.solver import gauss_newton
from patina.core.diagnose.solver.gauss_newton import equations_of, step_within_bounds
from patina.core.diagnose.solver.model_fit import ModelFit
from tests.make_lit_ball import changed, lit_ball

NORMALS = np.radians(0.3)  # expected error of the ball's exact normals
SATIN = 3  # training material


def drifting_ball():
    """A ball whose photos have gains of up to 60 %, which the baseline does not know. Its basis has
    the components of MERL alone: with the others, Gauss–Newton steps do not fail here."""
    whole, k = default_basis(), DEFAULT_COUNT
    merl = replace(
        whole, components=whole.components[:k], training=whole.training[:, :k], others=None
    )
    brdf = PrincipalBRDF(merl, merl.training[3 * SATIN : 3 * SATIN + 3])
    context = replace(lit_ball(2, SATIN), brdfs=MaterialBRDFs.of([brdf]))
    pixels = context.pixels
    gains = np.exp(np.random.default_rng(2).uniform(-0.6, 0.6, 6)).astype(np.float32)
    return changed(context, pixels.observed * gains[pixels.photo, None])


def test_a_fit_goes_on_where_gauss_newton_steps_fail(monkeypatch):
    context = drifting_ball()
    found = fit_baseline(context, NORMALS, 8).fitted
    monkeypatch.setattr(gauss_newton, "DAMPINGS", ())
    undamped = fit_baseline(context, NORMALS, 8).fitted
    assert found.total_cost < undamped.total_cost - 0.01 * found.residual.size


def test_damping_shortens_a_step_and_keeps_it_downhill():
    context = drifting_ball()
    now = fit_baseline(context, NORMALS, 8).fitted
    model = now.model.with_effect(LightIntensity.of(context))
    start = ModelFit.of(model, now.deviation)
    equations = equations_of(start)
    steps = [step_within_bounds(start, equations.damped(d)) for d in (0.0, 1.0, 100.0)]
    lengths = [float(np.linalg.norm(step.x)) for step in steps]
    assert lengths[0] > lengths[1] > lengths[2] > 0
    plain = step_within_bounds(start, equations)
    np.testing.assert_allclose(steps[0].x, plain.x, rtol=1e-6)
    place = model.place_of("light_intensity")
    x = list(model.x)
    x[place] = 0.1 * steps[2].x[-len(x[place]) :]
    assert ModelFit.of(replace(model, x=tuple(x)), now.deviation).total_cost < start.total_cost
