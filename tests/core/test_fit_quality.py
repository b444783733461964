"""Ratings of a fit."""

from __future__ import annotations

import pytest
from hypothesis import given
from hypothesis import strategies as st

from patina.core.fit.fit_quality import FitQuality, Rating

ORDER = [Rating.GOOD, Rating.FAIR, Rating.POOR]


@pytest.mark.parametrize(
    ("typical", "sentence"),
    [
        (0.07, "Typical error of a held-out photo: 7.0 % (good)"),
        (0.2, "Typical error of a held-out photo: 20 % (fair)"),
        (0.99, "Typical error of a held-out photo: 99 % (poor)"),
        (None, "Not rated: no photo was held out; two photos or more are needed"),
    ],
)
def test_sentences(typical: float | None, sentence: str) -> None:
    assert FitQuality(typical).sentence == sentence


@given(st.floats(0, 2), st.floats(0, 2))
def test_larger_errors_are_not_rated_better(one: float, other: float) -> None:
    low, high = sorted((one, other))
    assert ORDER.index(FitQuality(low).rating) <= ORDER.index(FitQuality(high).rating)
