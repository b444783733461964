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


def test_what_predicts_unseen_photos_worse_is_refused_with_its_figures():
    said = _worse(with_errors(0.10, 0.20), with_errors(0.12, 0.20))
    assert said is not None and "10.0 to 12.0 %" in said and "20.0 to 20.0 %" in said


@pytest.mark.parametrize("after", [(0.05, 0.2), (0.1, 0.2), (0.101, 0.2), (None, None)])
def test_what_is_better_or_alike_or_unknown_is_taken(after):
    assert _worse(with_errors(0.1, 0.2), with_errors(*after)) is None
