"""The lobe stack: physical constraints of the model, and a fit that recovers a known stack."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from patina.core.angles import light_view
from patina.core.appearance import lobe_model
from patina.core.appearance.cube_root import COARSE, quadrature
from patina.core.appearance.layered_model import Configuration
from patina.core.appearance.lobe_fit import fit_lobe_stack
from patina.core.appearance.lobe_stack import Lobe, LobeStack, albedo_fit
from patina.core.appearance.oren_nayar import oren_nayar

GREY = np.full(3, 0.5)
GLASS = Lobe(np.full(3, 0.04), np.ones(3), 0.3)
GOLD = Lobe(np.array([0.9, 0.6, 0.2]), np.ones(3), 0.15)
SATIN = Lobe(np.array([0.1, 0.02, 0.05]), np.array([0.5, 0.2, 0.3]), 0.6)
fraction = st.floats(0, 1)
color = st.tuples(fraction, fraction, fraction).map(np.array)


@st.composite
def stacks(draw, max_lobes=3):
    lobes = []
    for _ in range(draw(st.integers(0, max_lobes))):
        f90 = draw(color)
        facing, mid, grazing_albedo = (f90 * draw(color) for _ in range(3))
        lobes.append(Lobe(facing, f90, draw(st.floats(0.1, 1)), mid, grazing_albedo))
    return LobeStack(draw(color), draw(fraction), tuple(lobes), draw(color), draw(color))


def hemisphere(cos_o: float, n: int = 400):
    """Light directions (midpoint rule in cosθ and φ), a view direction and weights cosθ dω."""
    cos = (np.arange(n) + 0.5) / n
    phi = (np.arange(n) + 0.5) / n * np.pi  # the other half follows by symmetry
    cos, phi = (a.ravel() for a in np.meshgrid(cos, phi, indexing="ij"))
    sin = np.sqrt(1 - cos**2)
    light = np.stack([sin * np.cos(phi), sin * np.sin(phi), cos], axis=-1)
    view = np.array([np.sqrt(1 - cos_o**2), 0.0, cos_o])
    return light, view, cos * (2 * np.pi / n**2)


def directional_albedo(stack: LobeStack, cos_o: float, n: int = 400):
    light, view, weight = hemisphere(cos_o, n)
    return weight @ stack.reflectance(light, view)


@pytest.mark.parametrize("cos_o", [0.15, 0.5, 0.8, 1.0])
@pytest.mark.parametrize("roughness", [0.3, 0.6, 1.0])
def test_albedo_fit_matches_the_integral_of_a_lobe(cos_o, roughness):
    """The rational fit used for layering, compared with quadrature."""
    black = np.zeros(3)
    constant_albedo = directional_albedo(
        LobeStack(black, 0, (Lobe(np.ones(3), np.ones(3), roughness),)), cos_o
    )[0]
    grazing_albedo = directional_albedo(
        LobeStack(black, 0, (Lobe(black, np.ones(3), roughness),)), cos_o
    )[0]
    at_0, at_90 = albedo_fit(np.array(cos_o), roughness**2)
    assert at_0 + at_90 == pytest.approx(constant_albedo, abs=0.04)
    assert at_90 == pytest.approx(grazing_albedo, abs=0.04)


@settings(max_examples=30, deadline=None)
@given(stacks(), st.floats(0.1, 1))
def test_stack_conserves_energy(stack, cos_o):
    assert (directional_albedo(stack, cos_o, 150) < 1.04).all()


def test_white_stack_reflects_nearly_all_light():
    stack = LobeStack(np.ones(3), 0.0, (GLASS,))
    for cos_o in (0.3, 0.7, 1.0):
        np.testing.assert_allclose(directional_albedo(stack, cos_o), 1, atol=0.02)


@settings(max_examples=50, deadline=None)
@given(stacks(), st.floats(0, np.pi / 2), st.floats(0, np.pi / 2), st.floats(0, np.pi))
def test_reflectance_is_nonnegative_and_finite(stack, theta_i, theta_o, phi):
    light = np.array([np.sin(theta_i) * np.cos(phi), np.sin(theta_i) * np.sin(phi),
                      np.cos(theta_i)])  # fmt: skip
    view = np.array([np.sin(theta_o), 0, np.cos(theta_o)])
    f = stack.reflectance(light[None], view[None])
    assert np.isfinite(f).all() and (f >= 0).all()


def test_single_lobe_is_reciprocal_and_layers_nearly_so():
    """Layers are attenuated by the view direction only; a single lobe is reciprocal."""
    rng = np.random.default_rng(1)
    cos, phi = rng.uniform(0.3, 1, (2, 500)), rng.uniform(0, 2 * np.pi, (2, 500))
    sin = np.sqrt(1 - cos**2)
    a, b = np.stack([sin * np.cos(phi), sin * np.sin(phi), cos], axis=-1)
    single_lobe = LobeStack(np.zeros(3), 0, (SATIN,))
    np.testing.assert_allclose(
        single_lobe.reflectance(a, b), single_lobe.reflectance(b, a), rtol=1e-9
    )
    layered = LobeStack(GREY, 0.3, (GLASS,))
    forward, back = layered.reflectance(a, b), layered.reflectance(b, a)
    assert np.max(np.abs(forward / back - 1)) < 0.3  # within 72 degrees of the normal


def test_peak_value_of_a_lobe():
    """At normal incidence D = 1/(π α²) without masking: f = f0 / (4 π α²)."""
    up = np.array([[0.0, 0.0, 1.0]])
    f = LobeStack(np.zeros(3), 0, (GOLD,)).reflectance(up, up)[0]
    np.testing.assert_allclose(f, GOLD.f0 / (4 * np.pi * 0.15**4), rtol=1e-9)


def test_directions_below_the_horizon_reflect_nothing():
    up, down = np.array([[0.0, 0.0, 1.0]]), np.array([[0.6, 0.0, -0.8]])
    stack = LobeStack(GREY, 0.5, (GLASS,))
    assert stack.reflectance(down, up).max() == stack.reflectance(up, down).max() == 0


def test_rough_white_diffuse_reflects_all_light():
    """Multiple scattering compensates for the energy that single scattering loses."""
    for cos_o in (0.2, 0.6, 1.0):
        albedo = directional_albedo(LobeStack(np.ones(3), 1.0, ()), cos_o)
        np.testing.assert_allclose(albedo, 1, atol=0.01)


def test_diffuse_without_roughness_is_lambertian():
    one = np.array([0.3, 0.9])
    np.testing.assert_allclose(oren_nayar(GREY, 0.0, one, one, one), 0.5 / np.pi)


def test_derivatives_match_finite_differences():
    angles, _ = quadrature(COARSE)
    where = Configuration.of(*light_view(*angles))
    x = np.random.default_rng(3).uniform(0.2, 0.8, lobe_model.BASE + 2 * lobe_model.EACH)
    f, derivatives = lobe_model.reflectance_and_derivatives(x, where)
    np.testing.assert_allclose(f, lobe_model.stack_of(x).at(where), rtol=1e-9)
    for i in range(len(x)):
        moved = x.copy()
        moved[i] += 1e-5
        difference = (lobe_model.stack_of(moved).at(where) - f) / 1e-5
        scale = np.abs(difference).max() + 1e-6
        assert np.abs(derivatives[i] - difference).max() < 5e-3 * scale


def test_diffuse_colour_at_normal_and_grazing_angles():
    angle_dependent = LobeStack(GREY, 0.0, (), diffuse_mid=0 * GREY, diffuse_edge=np.ones(3))
    light = np.array([[0.0, 0.0, 1.0]])
    grazing = np.array([[np.sqrt(1 - 1e-8), 0.0, 1e-4]])
    np.testing.assert_allclose(angle_dependent.reflectance(light, light)[0], GREY / np.pi)
    np.testing.assert_allclose(angle_dependent.reflectance(light, grazing)[0], 1 / np.pi, rtol=1e-3)
    assert not angle_dependent.plain and LobeStack(GREY, 0.0, (GLASS,)).plain


TRUTHS = [
    LobeStack(np.array([0.6, 0.1, 0.05]), 0.0, (GLASS,)),
    LobeStack(np.zeros(3), 0.0, (GOLD,)),
    LobeStack(np.array([0.2, 0.3, 0.4]), 0.5, (Lobe(np.full(3, 0.03), np.full(3, 0.8), 0.1),
                                               Lobe(np.full(3, 0.05), np.full(3, 0.6), 0.5))),
]  # fmt: skip


@pytest.mark.parametrize("truth", TRUTHS, ids=["glossy", "metal", "two lobes"])
def test_fit_recovers_a_known_stack(truth):
    fit = fit_lobe_stack(truth.evaluate)
    assert fit.stack.plain and fit.error < 3e-3
    assert len(fit.stack.lobes) == len(truth.lobes)
    angles, _ = quadrature()
    np.testing.assert_allclose(fit.stack.evaluate(angles), truth.evaluate(angles), rtol=0.05)
    for found, true_lobe in zip(fit.stack.lobes, truth.lobes, strict=True):
        assert found.roughness == pytest.approx(true_lobe.roughness, abs=0.01)
        np.testing.assert_allclose(found.f0, true_lobe.f0, atol=0.01)


def test_more_lobes_never_increase_the_error():
    truth = LobeStack(GREY, 0.2, (SATIN, GLASS, GOLD))
    errors = fit_lobe_stack(truth.evaluate).errors
    assert list(errors.values()) == sorted(errors.values(), reverse=True)


def test_functions_of_a_configuration_do_not_depend_on_memory():
    """NumPy chooses another routine where the result lies behind a strided array."""
    light, view = light_view(*quadrature(COARSE)[0])
    where = Configuration.of(light, view)
    rng = np.random.default_rng(0)
    found = set()
    for _ in range(300):
        kept = [np.empty(n) for n in rng.integers(1, 3 * len(light), 20)]
        del kept[::2]
        found.add(np.cbrt(where.cos_i).tobytes())
    assert len(found) == 1
    assert all(a.flags.c_contiguous for a in (where.cos_i, where.cos_o, where.cos_h, where.cos_d))
