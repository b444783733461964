"""Trait shifts: linear in the logarithm, exact at 0, with physically impossible shifts reported."""

from __future__ import annotations

import re
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from patina.core.angles import Angles
from patina.core.appearance import trait_words, traits
from patina.core.appearance.energy import directional_albedo
from patina.core.appearance.hemisphere import Hemisphere
from patina.core.appearance.trait_words import Effect
from patina.core.basis import PrincipalBRDF, default_basis, mapping
from patina.core.views.sphere import LitSphere, lit_sphere


@pytest.fixture(scope="module")
def brdf() -> PrincipalBRDF:
    basis = default_basis()
    return PrincipalBRDF(basis, np.random.default_rng(0).normal(0, 0.03, (3, 40)))


@pytest.fixture(scope="module")
def angles() -> Angles:
    rng = np.random.default_rng(1)
    return Angles(rng.uniform(0, 1.5, 500), rng.uniform(0, 1.5, 500), rng.uniform(0, np.pi, 500))


def _shifts(seed: int) -> np.ndarray:
    return np.random.default_rng(seed).normal(0, 1.0, (3, 8))


def test_shift_is_in_standard_deviations_of_training_coefficients(brdf) -> None:
    basis, shifts = brdf.basis, _shifts(2)
    spread = basis.training.std(axis=0)[:8]
    np.testing.assert_allclose(traits.shift_unit(basis), spread, rtol=2e-3)
    there = traits.shifted(brdf, shifts).coefficients
    np.testing.assert_allclose(
        there[:, :8] - brdf.coefficients[:, :8], traits.shift_unit(basis) * shifts, atol=1e-12
    )
    np.testing.assert_array_equal(there[:, 8:], brdf.coefficients[:, 8:])
    # the paper's method has no more components
    few = PrincipalBRDF(basis, brdf.coefficients[:, :5])
    assert traits.shifted(few, shifts).coefficients.shape == (3, 5)


def test_zero_shift_is_measured_brdf_bit_for_bit(brdf, angles) -> None:
    none = np.zeros((3, 8))
    assert traits.shifted(brdf, none) is brdf
    there_and_back = traits.shifted(traits.shifted(brdf, _shifts(3)), none)
    assert there_and_back.coefficients is not brdf.coefficients
    shiftable = traits.ShiftableBRDF.of(brdf, traits.ComponentLookup.of(brdf.basis, angles))
    np.testing.assert_array_equal(shiftable.at(none), brdf.evaluate(angles))


def test_shift_is_linear_in_logarithm(brdf, angles) -> None:
    shiftable = traits.ShiftableBRDF.of(brdf, traits.ComponentLookup.of(brdf.basis, angles))
    weight = mapping.cos_map(angles)
    first, second = 0.3 * _shifts(4), 0.3 * _shifts(5)

    def log(shifts: np.ndarray) -> np.ndarray:
        return mapping.log_weighted(shiftable.at(shifts), weight)

    none = np.zeros((3, 8))
    both = log(first) + log(second) - log(none)
    floor = np.log(mapping.EPSILON) + 0.01  # the mapping allows no reflectance below it
    kept = np.min([log(s) for s in (none, first, second, first + second)], axis=0) > floor
    assert kept.mean() > 0.5
    np.testing.assert_allclose(log(first + second)[kept], both[kept], atol=2e-3)


def test_precomputed_lookup_matches_shifted_brdf(brdf, angles) -> None:
    shiftable = traits.ShiftableBRDF.of(brdf, traits.ComponentLookup.of(brdf.basis, angles))
    shifts = _shifts(6)
    expected = traits.shifted(brdf, shifts).evaluate(angles)
    np.testing.assert_allclose(shiftable.at(shifts), expected, rtol=2e-4, atol=1e-6)
    red = np.zeros((3, 8))
    red[0] = shifts[0]
    np.testing.assert_array_equal(shiftable.at(red)[:, 1:], shiftable.at(np.zeros((3, 8)))[:, 1:])


def test_shifted_sphere_matches_sphere_of_shifted_brdf(brdf) -> None:
    sphere, shifts = LitSphere.of(48), _shifts(7)
    parts = [
        traits.ShiftableBRDF.of(brdf, traits.ComponentLookup.of(brdf.basis, p.angles))
        for p in sphere.parts
    ]
    seen, coverage = sphere.picture([part.at(shifts) for part in parts])
    expected, inside = lit_sphere(traits.shifted(brdf, shifts).evaluate, 48)
    np.testing.assert_allclose(seen, expected, rtol=1e-3, atol=1e-4 * expected.max())
    np.testing.assert_array_equal(coverage, inside)
    unshifted, _ = sphere.picture([part.at(np.zeros((3, 8))) for part in parts])
    np.testing.assert_array_equal(unshifted, lit_sphere(brdf.evaluate, 48)[0])


def test_albedo_is_that_of_shifted_brdf(brdf) -> None:
    albedo, shifts = traits.ShiftableAlbedo.of(brdf), _shifts(8)
    shifted = traits.shifted(brdf, shifts)
    expected = directional_albedo(shifted.evaluate, np.array(traits.VIEWS))
    np.testing.assert_allclose(albedo.at(shifts), expected, rtol=1e-3)
    by_hand = []
    for theta in traits.VIEWS:
        sphere = Hemisphere.of(theta, 96, 24)
        by_hand.append(
            (sphere.cos_i * sphere.solid) @ shifted.evaluate(sphere.angles).astype(float)
        )
    np.testing.assert_allclose(expected, by_hand, rtol=1e-12)


def test_albedo_above_one_is_reported(brdf) -> None:
    albedo = traits.ShiftableAlbedo.of(brdf)
    assert traits.excess(albedo.at(np.zeros((3, 8)))) is None
    shifts = np.zeros((3, 8))
    shifts[1, 1] = -5.0  # green alone: a much brighter diffuse colour
    found = albedo.at(shifts)
    excess = traits.excess(found)
    assert excess is not None and excess[0] == pytest.approx(found[:, 1].max())
    assert excess[1] == traits.VIEWS[int(np.argmax(found[:, 1]))]
    assert traits.excess(np.full((7, 3), 1.005)) is None


def test_shift_beyond_measured_materials_is_reported(brdf) -> None:
    shifts = np.zeros((3, 8))
    assert traits.beyond_measured(brdf, shifts) == []
    shifts[2, 4], shifts[0, 1] = 9.0, 0.1
    assert traits.beyond_measured(brdf, shifts) == [4]
    unknown = PrincipalBRDF(replace(brdf.basis, training=None), brdf.coefficients)
    assert traits.beyond_measured(unknown, shifts) == []


def test_trait_words_follow_from_measured_change() -> None:
    found = [
        Effect(0.0, 2.0, -0.3, 0.0),
        Effect(-1.0, -0.2, 0.0, 0.05),
        Effect(0.05, 0.0, 0.0, 0.9),
        Effect(0.05, -0.09, 0.0, 0.0),
        Effect(0.6, 0.0, 0.28, 0.0),
    ]
    assert trait_words.words(found) == [
        "stronger, sharper highlight",
        "darker body",
        "more at grazing angles",
        trait_words.NO_EFFECT,
        "wider highlight, brighter body",
    ]


def test_no_two_components_have_the_same_words() -> None:
    """Three sliders of one name cannot be told apart; the strongest effect comes first in words."""
    grazing = [Effect(0.0, 0.0, 0.0, x) for x in (0.4, 1.2, -0.9, 0.15, 0.12)]
    assert trait_words.words(grazing) == [
        "more at grazing angles",
        "much more at grazing angles",
        "less at grazing angles",
        "slightly more at grazing angles",
        "slightly more at grazing angles (2)",
    ]
    own = trait_words.words(trait_words.effects(default_basis()))
    assert len({word for word in own if word != trait_words.NO_EFFECT}) == len(own) - own.count(
        trait_words.NO_EFFECT
    )


def test_component_changes_material_as_its_words_say() -> None:
    """On a material that none of the words was measured on, computed in another way."""
    basis = default_basis()
    words = trait_words.words(trait_words.effects(basis))
    plain = PrincipalBRDF(basis, np.zeros((3, 8)))
    theta = np.radians(np.linspace(0, 60, 241))
    profile = Angles(theta, np.full(241, 0.3), np.full(241, np.pi / 2))
    facing = np.radians([0.0])

    def shifted(component: int) -> PrincipalBRDF:
        shifts = np.zeros((3, 8))
        shifts[:, component] = 1.0
        return traits.shifted(plain, shifts)

    first, second, fourth = shifted(0), shifted(1), shifted(3)
    assert "stronger" in words[0] and "sharper" in words[0]
    seen, before = (b.evaluate(profile)[:, 0] for b in (first, plain))
    assert seen[0] > 5 * before[0] and seen[160] / seen[0] < 0.2 * before[160] / before[0]
    assert words[1] == "darker body"
    assert np.all(
        directional_albedo(second.evaluate, facing)
        < 0.6 * directional_albedo(plain.evaluate, facing)
    )
    assert words[3] == "much more at grazing angles"
    edge = Angles(np.zeros(2), np.radians([10.0, 80.0]), np.zeros(2))
    rise = [float(np.divide(*b.evaluate(edge)[::-1, 0])) for b in (fourth, plain)]
    assert rise[0] > 2 * rise[1]


def test_documented_table_matches_basis(root: Path) -> None:
    """docs/guide/traits.md, written by `run.py bench traits`."""
    from tools.bench_traits import table

    text = (root / "docs" / "guide" / "traits.md").read_text(encoding="utf-8")
    written = re.search(r"<!-- begin traits -->\n(.*?)\n<!-- end traits -->", text, re.S)
    assert written is not None and written.group(1) == table(default_basis())
