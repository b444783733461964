"""The lobe stack: physics of the model, and a fit that finds a stack again."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from patina.core.angles import light_view
from patina.core.appearance import lobe_model
from patina.core.appearance.cube_root import COARSE, quadrature
from patina.core.appearance.lobe_fit import fit_lobe_stack
from patina.core.appearance.lobe_stack import Lobe, LobeStack, albedo_fit
from patina.core.appearance.oren_nayar import oren_nayar
from patina.core.appearance.principled import Configuration

GREY = np.full(3, 0.5)
GLASS = Lobe(np.full(3, 0.04), np.ones(3), 0.3)
GOLD = Lobe(np.array([0.9, 0.6, 0.2]), np.ones(3), 0.15)
SATIN = Lobe(np.array([0.1, 0.02, 0.05]), np.array([0.5, 0.2, 0.3]), 0.6)
fraction = st.floats(0, 1)
color = st.tuples(fraction, fraction, fraction).map(np.array)


@st.composite
def stacks(draw, most=3):
    lobes = []
    for _ in range(draw(st.integers(0, most))):
        f90 = draw(color)
        facing, mid, edge = (f90 * draw(color) for _ in range(3))
        lobes.append(Lobe(facing, f90, draw(st.floats(0.1, 1)), mid, edge))
    return LobeStack(draw(color), draw(fraction), tuple(lobes), draw(color), draw(color))


def hemisphere(cos_o: float, n: int = 400):
    """Light directions by midpoints in cosθ and φ, a viewer: vectors and weights cosθ dω."""
    cos = (np.arange(n) + 0.5) / n
    phi = (np.arange(n) + 0.5) / n * np.pi  # the other half is its mirror image
    cos, phi = (a.ravel() for a in np.meshgrid(cos, phi, indexing="ij"))
    sin = np.sqrt(1 - cos**2)
    light = np.stack([sin * np.cos(phi), sin * np.sin(phi), cos], axis=-1)
    view = np.array([np.sqrt(1 - cos_o**2), 0.0, cos_o])
    return light, view, cos * (2 * np.pi / n**2)


def furnace(stack: LobeStack, cos_o: float, n: int = 400):
    light, view, weight = hemisphere(cos_o, n)
    return weight @ stack.reflectance(light, view)


@pytest.mark.parametrize("cos_o", [0.15, 0.5, 0.8, 1.0])
@pytest.mark.parametrize("roughness", [0.3, 0.6, 1.0])
def test_albedo_of_a_lobe_is_its_integral(cos_o, roughness):
    """The rational fit that the layering takes, against quadrature."""
    black = np.zeros(3)
    flat = furnace(LobeStack(black, 0, (Lobe(np.ones(3), np.ones(3), roughness),)), cos_o)[0]
    edge = furnace(LobeStack(black, 0, (Lobe(black, np.ones(3), roughness),)), cos_o)[0]
    at_0, at_90 = albedo_fit(np.array(cos_o), roughness**2)
    assert at_0 + at_90 == pytest.approx(flat, abs=0.04)
    assert at_90 == pytest.approx(edge, abs=0.04)


@settings(max_examples=30, deadline=None)
@given(stacks(), st.floats(0.1, 1))
def test_no_energy_is_gained(stack, cos_o):
    assert (furnace(stack, cos_o, 150) < 1.04).all()


def test_a_white_stack_gives_nearly_all_light_back():
    stack = LobeStack(np.ones(3), 0.0, (GLASS,))
    for cos_o in (0.3, 0.7, 1.0):
        np.testing.assert_allclose(furnace(stack, cos_o), 1, atol=0.02)


@settings(max_examples=50, deadline=None)
@given(stacks(), st.floats(0, np.pi / 2), st.floats(0, np.pi / 2), st.floats(0, np.pi))
def test_positive_and_finite(stack, theta_i, theta_o, phi):
    light = np.array([np.sin(theta_i) * np.cos(phi), np.sin(theta_i) * np.sin(phi),
                      np.cos(theta_i)])  # fmt: skip
    view = np.array([np.sin(theta_o), 0, np.cos(theta_o)])
    f = stack.reflectance(light[None], view[None])
    assert np.isfinite(f).all() and (f >= 0).all()


def test_how_far_from_reciprocal():
    """Layers are darkened towards the viewer alone; a lobe by itself is reciprocal."""
    rng = np.random.default_rng(1)
    cos, phi = rng.uniform(0.3, 1, (2, 500)), rng.uniform(0, 2 * np.pi, (2, 500))
    sin = np.sqrt(1 - cos**2)
    a, b = np.stack([sin * np.cos(phi), sin * np.sin(phi), cos], axis=-1)
    alone = LobeStack(np.zeros(3), 0, (SATIN,))
    np.testing.assert_allclose(alone.reflectance(a, b), alone.reflectance(b, a), rtol=1e-9)
    layered = LobeStack(GREY, 0.3, (GLASS,))
    forth, back = layered.reflectance(a, b), layered.reflectance(b, a)
    assert np.max(np.abs(forth / back - 1)) < 0.3  # within 72 degrees of the normal


def test_the_peak_of_a_lobe():
    """Head on, D = 1/(π α²) and no masking: f = f0 / (4 π α²)."""
    up = np.array([[0.0, 0.0, 1.0]])
    f = LobeStack(np.zeros(3), 0, (GOLD,)).reflectance(up, up)[0]
    np.testing.assert_allclose(f, GOLD.f0 / (4 * np.pi * 0.15**4), rtol=1e-9)


def test_light_below_the_horizon_gives_nothing():
    up, down = np.array([[0.0, 0.0, 1.0]]), np.array([[0.6, 0.0, -0.8]])
    stack = LobeStack(GREY, 0.5, (GLASS,))
    assert stack.reflectance(down, up).max() == stack.reflectance(up, down).max() == 0


def test_rough_diffuse_white_keeps_all_light():
    """Multiple scattering brings back what single scattering loses."""
    for cos_o in (0.2, 0.6, 1.0):
        albedo = furnace(LobeStack(np.ones(3), 1.0, ()), cos_o)
        np.testing.assert_allclose(albedo, 1, atol=0.01)


def test_diffuse_without_roughness_is_lambertian():
    one = np.array([0.3, 0.9])
    np.testing.assert_allclose(oren_nayar(GREY, 0.0, one, one, one), 0.5 / np.pi)


def test_derivatives_are_those_of_the_model():
    angles, _ = quadrature(COARSE)
    where = Configuration.of(*light_view(*angles))
    x = np.random.default_rng(3).uniform(0.2, 0.8, lobe_model.BASE + 2 * lobe_model.EACH)
    f, slopes = lobe_model.reflectance_and_derivatives(x, where)
    np.testing.assert_allclose(f, lobe_model.stack_of(x).at(where), rtol=1e-9)
    for i in range(len(x)):
        moved = x.copy()
        moved[i] += 1e-5
        difference = (lobe_model.stack_of(moved).at(where) - f) / 1e-5
        scale = np.abs(difference).max() + 1e-6
        assert np.abs(slopes[i] - difference).max() < 5e-3 * scale


def test_colours_at_the_facing_and_at_the_edge():
    turning = LobeStack(GREY, 0.0, (), diffuse_mid=0 * GREY, diffuse_edge=np.ones(3))
    light = np.array([[0.0, 0.0, 1.0]])
    almost = np.array([[np.sqrt(1 - 1e-8), 0.0, 1e-4]])
    np.testing.assert_allclose(turning.reflectance(light, light)[0], GREY / np.pi)
    np.testing.assert_allclose(turning.reflectance(light, almost)[0], 1 / np.pi, rtol=1e-3)
    assert not turning.plain and LobeStack(GREY, 0.0, (GLASS,)).plain


TRUTHS = [
    LobeStack(np.array([0.6, 0.1, 0.05]), 0.0, (GLASS,)),
    LobeStack(np.zeros(3), 0.0, (GOLD,)),
    LobeStack(np.array([0.2, 0.3, 0.4]), 0.5, (Lobe(np.full(3, 0.03), np.full(3, 0.8), 0.1),
                                               Lobe(np.full(3, 0.05), np.full(3, 0.6), 0.5))),
]  # fmt: skip


@pytest.mark.parametrize("truth", TRUTHS, ids=["glossy", "metal", "two lobes"])
def test_finds_a_stack_again(truth):
    fit = fit_lobe_stack(truth.evaluate)
    assert fit.stack.plain and fit.error < 3e-3
    assert len(fit.stack.lobes) == len(truth.lobes)
    angles, _ = quadrature()
    np.testing.assert_allclose(fit.stack.evaluate(angles), truth.evaluate(angles), rtol=0.05)
    for found, own in zip(fit.stack.lobes, truth.lobes, strict=True):
        assert found.roughness == pytest.approx(own.roughness, abs=0.01)
        np.testing.assert_allclose(found.f0, own.f0, atol=0.01)


def test_more_lobes_are_never_farther_off():
    truth = LobeStack(GREY, 0.2, (SATIN, GLASS, GOLD))
    errors = fit_lobe_stack(truth.evaluate).errors
    assert list(errors.values()) == sorted(errors.values(), reverse=True)
