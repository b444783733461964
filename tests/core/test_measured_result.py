"""Stored results of a measured fit: standard deviation between nodes, interval, gains."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from patina.core.angles import Angles, cosines
from patina.core.basis import AngleGrid, PrincipalBRDF, default_basis
from patina.core.fit.measured.cell_weights import REGIONS
from patina.core.fit.measured_result import COARSE, Band, MeasuredResult
from patina.core.fit.spread import candidate_spread


def made_result(deviation: float, gains: dict[int, float] | None = None) -> MeasuredResult:
    """A BRDF of the basis with the same uncertainty everywhere."""
    basis = default_basis()
    grid = AngleGrid(*COARSE, basis.grid.knee)
    return MeasuredResult(
        brdf=PrincipalBRDF(basis, np.full((3, 5), 0.02)),
        samples=1000,
        normal_deviation=1.0,
        gains=gains or {},
        extrapolation="",
        band=Band(grid, np.full((grid.size, 3), deviation, np.float32)),
        warnings=(),
        covariance=np.eye(5) * deviation**2,
        cells_per_region=np.zeros(REGIONS, np.intp),
    )


@settings(deadline=None, max_examples=30)
@given(deviation=st.floats(0.001, 1.0))
def test_interval_covers_ninety_percent_of_lognormal(deviation: float) -> None:
    result = made_result(deviation)
    angles = Angles(*np.radians([[5.0, 40.0], [20.0, 50.0], [90.0, 30.0]]))
    low, high = result.interval(angles)
    cos_i, cos_o = cosines(*angles)
    weight = np.clip(cos_i * cos_o, 0.01, 1)[:, None]
    middle = result.brdf.evaluate(angles) * weight + 0.001
    drawn = np.exp(deviation * np.linspace(-1.6448, 1.6448, 2))  # 5 % beyond either end
    assert np.allclose(np.maximum(middle * drawn[0] - 0.001, 0) / weight, low, rtol=1e-3, atol=1e-5)
    assert np.allclose((middle * drawn[1] - 0.001) / weight, high, rtol=1e-3, atol=1e-5)
    assert (low <= high).all() and (low >= 0).all()


def test_uniform_band_keeps_its_width() -> None:
    spread = made_result(0.2).band.spread()
    for value in (spread.median, spread.percentile_90, spread.at_highlight):
        assert value == pytest.approx(0.2, rel=1e-5)


def test_stored_band_equals_that_of_fit() -> None:
    """A posterior of known covariance: the standard deviation between nodes is that of Q̂ c."""
    basis = default_basis()
    rng = np.random.default_rng(0)
    covariance = np.diag(rng.uniform(1e-5, 1e-3, 30))

    class Fit:
        brdf = PrincipalBRDF(basis, np.zeros((3, 30)))

        @staticmethod
        def band(angles: Angles) -> np.ndarray:
            q = basis.rows(angles, 30)[1].astype(float)
            return np.repeat(np.sqrt(np.einsum("nk,kl,nl->n", q, covariance, q))[:, None], 3, 1)

    kept = Band.of(Fit)  # type: ignore[arg-type]
    angles = Angles(*(rng.uniform(0.02, top, 3000) for top in (1.2, 1.0, np.pi)))
    seen = np.minimum(*cosines(*angles)) > 0.2
    angles = Angles(*(a[seen] for a in angles))
    ratio = kept.deviation(angles) / Fit.band(angles)
    assert np.abs(np.median(ratio) - 1) < 0.03 and np.percentile(np.abs(ratio - 1), 95) < 0.15


def test_only_significant_gains_are_reported() -> None:
    result = made_result(0.1, {0: 1.0, 1: 1.03, 4: 0.9})
    assert result.gains_beyond(0.02) == {1: 1.03, 4: 0.9}
    assert replace(result, gains={}).gains_beyond(0.0) == {}


def test_spread_of_candidates_is_their_standard_deviation() -> None:
    """Two candidates that differ by a step in the first component: ± half of the step."""
    basis = default_basis()
    c = np.zeros((2, 3, 5))
    c[1, :, 0] = 0.01
    found = candidate_spread(basis, c)
    some = Angles(*np.radians([[40.0], [20.0], [90.0]]))
    half = 0.005 * abs(float(basis.rows(some, 1)[1][0, 0]))
    assert 0.5 * half < found.median < 2 * half
