"""The second fit is proposed only where it predicts unseen photos no worse."""

from __future__ import annotations

from types import SimpleNamespace

import pytest

from patina.core.job.refit_job import _worse


def with_errors(*errors: float | None) -> list[SimpleNamespace]:
    """Materials whose unseen photos are off by so much."""
    return [
        SimpleNamespace(held_out=None if e is None else SimpleNamespace(error=e)) for e in errors
    ]


def again(*errors: float | None, light: float = 1.0) -> list[SimpleNamespace]:
    """The same of second fits."""
    return [SimpleNamespace(material=m, light=light) for m in with_errors(*errors)]


def test_what_predicts_unseen_photos_worse_is_refused_with_its_figures():
    said = _worse(with_errors(0.10, 0.20), again(0.12, 0.20))
    assert said is not None and "10.0 to 12.0 %" in said and "20.0 to 20.0 %" in said


@pytest.mark.parametrize("after", [(0.05, 0.2), (0.1, 0.2), (0.101, 0.2), (None, None)])
def test_what_is_better_or_alike_or_unknown_is_taken(after):
    assert _worse(with_errors(0.1, 0.2), again(*after)) is None


def test_errors_are_of_the_light_as_it_was():
    """Light that is taken away leaves the same miss of less light."""
    assert _worse(with_errors(0.1), again(0.13, light=0.7)) is None
    assert _worse(with_errors(0.1), again(0.13, light=0.9)) is not None


def test_a_material_that_could_not_be_fitted_again_says_nothing():
    none = SimpleNamespace(material=None, light=1.0)
    assert _worse(with_errors(0.1), [none]) is None
