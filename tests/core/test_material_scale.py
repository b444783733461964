"""The factor of a material's reflectance: part of every fit, and of the BRDFs afterwards."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from patina.core.basis import PrincipalBRDF, default_basis
from patina.core.diagnose.nuisances.material_scale import MaterialScale
from patina.core.diagnose.solver.block_elimination import solve
from patina.core.diagnose.solver.gauss_newton import equations_of, fit, step_within_bounds
from patina.core.diagnose.solver.jacobian import jacobian_of
from patina.core.diagnose.solver.model import Model
from patina.core.diagnose.solver.model_fit import ModelFit
from patina.core.diagnose.solver.normal_equations import NormalEquations
from patina.core.diagnose.solver.residual_scale import expected_deviation
from patina.core.diagnose.solver.scaled_brdfs import scaled_brdfs, with_brdf
from tests.make_lit_ball import GLOSSY, changed, lit_ball

SCALE = 1.7  # ln
DARK = 0.1  # brightness of a material


class NarrowScale(MaterialScale):
    @property
    def parameters(self):
        return replace(super().parameters, low=np.full(1, -0.3), high=np.full(1, 0.3))


def darkened(context):
    """The same photos of a material that is DARK times as bright."""
    darker = changed(context, DARK * context.pixels.observed)
    return replace(darker, pixels=replace(darker.pixels, noise=DARK**2 * context.pixels.noise))


@pytest.fixture(scope="module")
def context():
    return lit_ball(5, GLOSSY)


@pytest.fixture(scope="module")
def model(context) -> Model:
    effect = MaterialScale.of(context)
    return Model(context.pixels, context.brdfs).with_effect(effect, np.array([SCALE]))


def test_scaled_brdfs_predict_what_the_model_does(context, model):
    alone = Model(context.pixels, scaled_brdfs(model))
    assert alone.predicted() == pytest.approx(model.predicted(), rel=1e-5)
    plain = Model(context.pixels, context.brdfs)
    assert model.predicted() == pytest.approx(np.exp(SCALE) * plain.predicted(), rel=1e-5)
    assert scaled_brdfs(plain) is plain.brdfs


def test_another_brdf_is_not_scaled(context, model):
    basis = default_basis()
    brdf = PrincipalBRDF(basis, basis.training[30:33])
    found = with_brdf(model, 0, brdf)
    angles = found.shading().angles
    material = np.zeros(len(context.pixels), np.intp)
    assert found.brdfs.evaluate(angles, material) == pytest.approx(brdf.evaluate(angles), rel=1e-4)


def test_derivative_of_scaled_brdfs_is_that_of_their_reflectance(context, model):
    """By difference quotients of a coefficient of the first component."""
    brdfs, step = scaled_brdfs(model), 1e-3
    state = Model(context.pixels, brdfs).shading()
    moved = brdfs.coefficients.copy()
    moved[0, :, 0] += step
    quotient = (replace(brdfs, coefficients=moved).reflected(state) - brdfs.reflected(state)) / step
    row = brdfs.rows(state.angles)[:, :1]
    bright = brdfs.reflected(state) > 0.05
    stated = brdfs.log_derivative(state) * row
    assert quotient[bright] == pytest.approx(stated[bright], rel=0.03, abs=1e-4)


def test_a_darker_material_is_explained_by_the_factor(context):
    """A material of the basis, but a tenth as bright: with its own factor the fit costs less than
    without, and nothing but the factor and the BRDF is needed."""
    darker = darkened(context)
    start = Model(darker.pixels, darker.brdfs)
    deviation = expected_deviation(darker.pixels, darker.brdfs, np.radians(0.3))
    without = fit(start, deviation)
    with_factor = fit(start.with_effect(MaterialScale.of(darker)), deviation)
    assert with_factor.total_cost < without.total_cost
    assert with_factor.model.x[0][0] < -1


def test_steps_just_inside_a_bound_are_those_at_the_bound(context):
    """The coefficients follow the factor as far as it moves, and not as far as it would: a fit
    would otherwise stop there, since each step costs more than it gains."""
    darker = darkened(context)
    deviation = expected_deviation(darker.pixels, darker.brdfs, np.radians(0.3))
    scale = NarrowScale.of(darker)
    low = scale.parameters.low
    start = fit(Model(darker.pixels, darker.brdfs).with_effect(scale, low), deviation, 2).model
    at = ModelFit.of(start, deviation)
    near = ModelFit.of(replace(start, x=(low + 1e-3,)), deviation)
    everything = np.arange(len(near.residual))
    unbounded = solve(NormalEquations.of(near, jacobian_of(near), everything), near)
    assert unbounded.x[0] < -0.1
    found, expected = (step_within_bounds(one, equations_of(one)) for one in (near, at))
    assert found.x == pytest.approx(-1e-3, abs=1e-9) and expected.x == pytest.approx(0.0)
    size = np.abs(expected.coefficients).max()
    assert found.coefficients == pytest.approx(expected.coefficients, abs=0.02 * size)
    assert np.abs(unbounded.coefficients - expected.coefficients).max() > 0.1 * size
