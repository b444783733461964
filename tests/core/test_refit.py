"""The second fit is proposed only where it predicts unseen photos no worse."""

from __future__ import annotations

from types import SimpleNamespace

import pytest

from patina.core.fit.held_out import HeldOut
from patina.core.job.refused import worse


def with_errors(*errors: float | None) -> list[SimpleNamespace]:
    """Materials of which each of three unseen photos is off by so much."""
    return [
        SimpleNamespace(held_out=None if e is None else HeldOut(e, e, dict.fromkeys(range(3), e)))
        for e in errors
    ]


def again(*errors: float | None, light: float = 1.0) -> list[SimpleNamespace]:
    """The same of second fits."""
    return [SimpleNamespace(material=m, light=light) for m in with_errors(*errors)]


def test_what_predicts_unseen_photos_worse_is_refused_with_its_figures():
    said = worse(with_errors(0.10, 0.20), again(0.12, 0.20))
    assert said is not None and "10.0 to 12.0 %" in said and "20.0 to 20.0 %" in said


@pytest.mark.parametrize("after", [(0.05, 0.2), (0.1, 0.2), (0.101, 0.2), (None, None)])
def test_what_is_better_or_alike_or_unknown_is_taken(after):
    assert worse(with_errors(0.1, 0.2), again(*after)) is None


def test_one_photo_of_many_does_not_decide():
    """The worst photo is twice as bad; all others are better."""
    photos = range(8)
    before = [SimpleNamespace(held_out=HeldOut(0.2, 0.1, {p: 0.1 for p in photos}))]
    other = {p: 0.2 if p == 0 else 0.08 for p in photos}
    after = SimpleNamespace(held_out=HeldOut(0.25, 0.1, other))
    found = [SimpleNamespace(material=after, light=1.0)]
    assert worse(before, found) is None
    assert worse(before, [SimpleNamespace(material=after, light=2.0)]) is not None


def test_what_materials_and_causes_say_together_counts():
    """A few percent worse alone, but much better where both are fitted at once; or not."""
    before, after = with_errors(0.1), again(0.105)
    assert worse(before, after) is not None
    assert worse(before, after, jointly=-0.15) is None
    assert worse(before, after, jointly=-0.01) is not None


def test_errors_are_of_the_light_as_it_was():
    """Light that is taken away leaves the same miss of less light."""
    assert worse(with_errors(0.1), again(0.13, light=0.7)) is None
    assert worse(with_errors(0.1), again(0.13, light=0.9)) is not None


def test_a_material_that_could_not_be_fitted_again_says_nothing():
    none = SimpleNamespace(material=None, light=1.0)
    assert worse(with_errors(0.1), [none]) is None
