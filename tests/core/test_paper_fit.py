"""The paper's estimator: each assumption has its stated effect; the fit recovers a material."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from patina.core.basis import default_basis
from patina.core.errors import FitError
from patina.core.fit import PaperSettings, fit_paper, reliability, selection
from patina.core.fit.held_out import fit_without_photo, photos_to_hold_out, summarise
from patina.core.fit.ridge import solve
from patina.core.fit.spread import candidate_spread
from patina.core.predict import similarity_sums
from patina.core.samples import SampleTable
from patina.core.samples.level import at_typical_level
from tests import make_capture as made
from tests.sampled import sampled


@pytest.fixture(scope="module")
def table(tmp_path_factory: pytest.TempPathFactory) -> SampleTable:
    return sampled(made.make_capture(tmp_path_factory.mktemp("ball")))[0]


def test_ridge_solves_the_regularised_normal_equations() -> None:
    rng = np.random.default_rng(0)
    q, x = rng.normal(size=(6, 6)), rng.normal(size=(6, 3))
    c = solve(q, x, 40.0)
    gradient = q.T @ (q @ c.T - x) + 40.0 * c.T
    assert np.abs(gradient).max() < 1e-10


def test_condition_numbers_match_numpy() -> None:
    rng = np.random.default_rng(1)
    selected, candidates = rng.normal(size=(3, 5)), rng.normal(size=(20, 5))
    found = selection.condition_numbers(selected, candidates)
    expected = [np.linalg.cond(np.vstack([selected, row])) for row in candidates]
    assert np.allclose(found, expected)


def test_selection_beats_random_sets_and_keeps_fixed_row() -> None:
    rng = np.random.default_rng(2)
    rows = rng.normal(size=(300, 6)) * np.array([30, 10, 5, 3, 2, 1])
    everything = lambda selected: np.ones(300, bool)  # noqa: E731
    selected = selection.choose(rows, 6, everything, fixed=17)
    assert selected is not None and 17 in selected and len(set(selected.tolist())) == 6
    ours = np.linalg.cond(rows[selected])
    others = [np.linalg.cond(rows[[17, *rng.choice(300, 5, replace=False)]]) for _ in range(500)]
    assert ours < np.min(others)
    nothing = lambda selected: np.zeros(300, bool)  # noqa: E731
    assert selection.choose(rows, 6, nothing) is None


def test_selected_samples_are_monotone_and_well_conditioned(table: SampleTable) -> None:
    fit = fit_paper(table, default_basis(), PaperSettings(trials=3))
    order = np.argsort(fit.chosen.theta_h)
    rho = fit.chosen.rho.mean(axis=1)[order]
    assert (np.diff(rho) < 0).all()  # farther from the half vector, hence darker
    assert (np.abs(fit.chosen.curvature[1:]) <= 0.2).all()
    assert fit.chosen.theta_h[0] == 0  # the specular peak


def test_every_assumption_can_be_switched_off(table: SampleTable) -> None:
    basis = default_basis()
    off = PaperSettings(
        trials=4, monotonicity=False, highest_intensity=False, curvature=None, subset=300
    )
    fit = fit_paper(table, basis, off)
    assert fit.reliable == len(table)
    assert fit.chosen.theta_h.min() > 0
    free = [
        fit_paper(table, basis, PaperSettings(trials=1, monotonicity=False, subset=300, seed=seed))
        for seed in range(6)
    ]
    assert all(fit.chosen.theta_h[0] == 0 for fit in free)
    rising = [np.diff(f.chosen.rho.mean(axis=1)[np.argsort(f.chosen.theta_h)]) > 0 for f in free]
    assert np.any(rising)  # without the test some selected sets are not monotone


def test_peak_uses_half_vector_as_normal(table: SampleTable) -> None:
    row, peak = reliability.highest_intensity(table)
    assert row == table.radiance.mean(axis=1).argmax()
    light = peak.light.astype(float)
    half = light + peak.view
    half /= np.linalg.norm(half, axis=1, keepdims=True)
    assert np.allclose(peak.normal, half, atol=1e-6) and peak.theta_h[0] == 0
    expected = peak.radiance / (made.IRRADIANCE * np.sum(half * light, axis=1)[:, None])
    assert np.allclose(peak.rho, expected, rtol=1e-5)


def test_fit_recovers_material(table: SampleTable) -> None:
    """A Blinn lobe is not a MERL material: six samples can reach a fifth over the directions in the
    photos; the diffuse colour is right.
    """
    fit = fit_paper(table, default_basis())
    seen = fit.brdf.evaluate(table.angles)
    ratio = np.log(seen / table.rho)
    assert np.median(np.abs(ratio)) < 0.25
    assert np.abs(np.median(ratio, axis=0)).max() < 0.25
    best = int(fit.similarity.argmax())
    assert fit.similarity[best] > 0.95
    assert np.array_equal(fit.brdf.coefficients, fit.candidates[best])


def test_same_seed_gives_same_coefficients(table: SampleTable) -> None:
    a, b, c = (
        fit_paper(table, default_basis(), PaperSettings(trials=2, seed=seed)) for seed in (4, 4, 5)
    )
    assert np.array_equal(a.brdf.coefficients, b.brdf.coefficients)
    assert not np.array_equal(a.brdf.coefficients, c.brdf.coefficients)


def test_similarity_is_the_cosine(table: SampleTable) -> None:
    basis = default_basis()
    c = np.random.default_rng(3).normal(0, 0.03, (2, 3, 6))
    part = table.select(np.arange(0, len(table), 7))
    found = similarity_sums(basis, c, part)
    for i in range(2):
        scale = part.irradiance * part.cos_i[:, None]
        predicted = (basis.evaluate(c[i], part.angles) * scale).ravel()
        measured = part.radiance.ravel()
        expected = predicted @ measured / np.linalg.norm(predicted) / np.linalg.norm(measured)
        assert found[i] == pytest.approx(expected, rel=1e-4)


def test_held_out_photo_is_predicted_and_single_photo_has_none(table: SampleTable) -> None:
    basis = default_basis()
    assert photos_to_hold_out(table) == list(range(6))
    parts = [fit_without_photo(table, photo, basis, PaperSettings(trials=2)) for photo in range(6)]
    held = summarise([part for part in parts if part is not None])
    assert held is not None and set(held.per_photo) == set(range(6))
    assert 0 < held.error < 0.8 and 0 < held.typical < 0.4
    assert photos_to_hold_out(table.select(table.photo == 0)) == [] and summarise([]) is None


def test_too_few_samples_are_rejected(table: SampleTable) -> None:
    with pytest.raises(FitError, match="at least 24"):
        fit_paper(table.select(np.arange(10)), default_basis())


def test_equal_candidates_have_no_spread() -> None:
    c = np.tile(np.random.default_rng(0).normal(0, 0.03, (1, 3, 6)), (4, 1, 1))
    spread = candidate_spread(default_basis(), c)
    assert spread.median < 1e-5
    c[0] *= 2
    assert candidate_spread(default_basis(), c).median > 0.01


def test_unknown_irradiance_is_a_single_scale(tmp_path: Path) -> None:
    path = made.make_capture(tmp_path / "ball", photos=2)
    known, _ = sampled(path)
    path.write_text(path.read_text().replace("irradiance = [3.0, 3.0, 3.0]\n", ""))
    unknown, _ = sampled(path)
    assert np.allclose(unknown.rho, known.rho * made.IRRADIANCE, rtol=1e-5)


def test_default_settings_are_those_of_paper() -> None:
    s = PaperSettings()
    assert (s.samples, s.trials, s.eta, s.curvature) == (6, 10, 40.0, 0.2)
    assert s.monotonicity and s.highest_intensity


def test_descent_improves_on_greedy_growth() -> None:
    rng = np.random.default_rng(8)
    gained = 0
    for _ in range(10):
        rows = rng.normal(size=(200, 6)) * np.array([30, 10, 5, 3, 2, 1])
        everything = lambda selected: np.ones(200, bool)  # noqa: E731
        greedy = selection.choose(rows, 6, everything, sweeps=0)
        descended = selection.choose(rows, 6, everything)
        assert greedy is not None and descended is not None
        better = np.linalg.cond(rows[descended]) / np.linalg.cond(rows[greedy])
        assert better <= 1 + 1e-9
        gained += better < 0.95
    assert gained >= 5


def test_brighter_lamp_is_not_a_highlight(table: SampleTable) -> None:
    """Twenty times the light in one photo: the same reflectance, the same peak."""
    factor = np.ones(6, np.float32)
    factor[1] = 20
    brighter = replace(
        table,
        radiance=table.radiance * factor[table.photo, None],
        irradiance=table.irradiance * factor[table.photo, None],
    )
    assert reliability.highest_intensity(brighter)[0] == reliability.highest_intensity(table)[0]


def test_fit_with_unknown_irradiance_is_independent_of_unit(table: SampleTable) -> None:
    """The mapping depends on scale, so the level that it is given must not."""
    basis = default_basis()
    found = []
    for unit in (1e-3, 1.0, 500.0):
        scaled = replace(
            table, rho=table.rho * np.float32(unit), radiance=table.radiance * np.float32(unit)
        )
        levelled, factor = at_typical_level(scaled, basis)
        fit = fit_paper(levelled, basis, PaperSettings(trials=2))
        found.append((fit.brdf.coefficients, factor * unit))
    for coefficients, factor in found:
        assert np.allclose(coefficients, found[0][0], atol=1e-4)
        assert factor == pytest.approx(found[0][1], rel=1e-4)


def test_hue_error_counts_as_error(table: SampleTable) -> None:
    """Red too bright and green too dark by the same amount: the channel mean is right, the photo is
    not.
    """
    basis = default_basis()
    brdf = fit_paper(table.select(table.photo != 0), basis, PaperSettings(trials=2, seed=1)).brdf
    exact = brdf.evaluate(table.angles) * table.irradiance * table.cos_i[:, None]
    shift = 0.3 * exact.mean(axis=1)
    hued = exact + np.stack([shift, -shift, np.zeros_like(shift)], axis=1)
    radiance = np.where((table.photo == 0)[:, None], hued, table.radiance).astype(np.float32)
    part = fit_without_photo(
        replace(table, radiance=radiance), 0, basis, PaperSettings(trials=2, seed=0)
    )
    assert part is not None and np.median(part.relative) == pytest.approx(0.2, abs=0.01)
