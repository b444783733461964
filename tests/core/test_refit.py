"""The second fit is proposed only where it predicts unseen photos no worse."""

from __future__ import annotations

from dataclasses import dataclass
from types import SimpleNamespace

import pytest

from patina.core.concurrency.job import Step
from patina.core.fit.held_out import HeldOutErrors
from patina.core.jobs import refit_job
from patina.core.jobs.acceptance import Refit, Rejection, evidence_against


def with_errors(*errors: float | None) -> list[SimpleNamespace]:
    """Materials of which each of three unseen photos is off by so much."""
    return [
        SimpleNamespace(
            name=f"material {k}",
            held_out=None if e is None else HeldOutErrors(e, e, dict.fromkeys(range(3), e)),
        )
        for k, e in enumerate(errors, 1)
    ]


def again(*errors: float | None, light: float = 1.0) -> list[SimpleNamespace]:
    """The same of second fits, in so much of each photo's light."""
    by_photo = dict.fromkeys(range(3), light)
    return [SimpleNamespace(material=m, light=by_photo) for m in with_errors(*errors)]


def test_what_predicts_unseen_photos_worse_is_refused_with_its_figures():
    said = evidence_against(with_errors(0.10, 0.20), again(0.12, 0.20))
    assert said is not None and said.of_cause
    assert "increases from 10.0 % to 12.0 % for material 1" in said.evidence
    assert "stays at 20.0 % for material 2" in said.evidence


@pytest.mark.parametrize("after", [(0.05, 0.2), (0.1, 0.2), (0.101, 0.2), (None, None)])
def test_what_is_better_or_alike_or_unknown_is_taken(after):
    assert evidence_against(with_errors(0.1, 0.2), again(*after)) is None


def test_one_photo_of_many_does_not_decide():
    """The worst photo is twice as bad; all others are better."""
    photos = range(8)
    before = [
        SimpleNamespace(name="clay", held_out=HeldOutErrors(0.2, 0.1, {p: 0.1 for p in photos}))
    ]
    other = {p: 0.2 if p == 0 else 0.08 for p in photos}
    after = SimpleNamespace(held_out=HeldOutErrors(0.25, 0.1, other))
    found = SimpleNamespace(material=after, light=dict.fromkeys(photos, 1.0))
    assert evidence_against(before, [found]) is None
    found = SimpleNamespace(material=after, light=dict.fromkeys(photos, 2.0))
    assert evidence_against(before, [found]) is not None


def test_what_materials_and_causes_say_together_counts():
    """A few percent worse alone, but much better where both are fitted at once; or not."""
    before, after = with_errors(0.1), again(0.105)
    assert evidence_against(before, after) is not None
    assert evidence_against(before, after, jointly=-0.15) is None
    assert evidence_against(before, after, jointly=-0.01) is not None


def test_a_cause_may_be_there_though_the_second_fit_makes_nothing_of_it():
    """A wide lamp: fitted together all is far better, its samples alone say less than before."""
    said = evidence_against(with_errors(0.1), again(0.12), jointly=-1.0)
    assert said is not None and not said.of_cause
    assert evidence_against(with_errors(0.1), again(0.12)).of_cause


def test_errors_are_of_the_light_as_it_was():
    """Light that is taken away leaves the same miss of less light."""
    assert evidence_against(with_errors(0.1), again(0.13, light=0.7)) is None
    assert evidence_against(with_errors(0.1), again(0.13, light=0.9)) is not None


def test_each_photo_is_judged_in_its_own_light():
    """A room is most of what the dark photo shows: there the lamp's light is missed by as much as
    before of all its light, which is three times as much of the lamp's."""
    before = [SimpleNamespace(name="clay", held_out=HeldOutErrors(0.1, 0.1, {0: 0.1, 1: 0.1}))]
    after = SimpleNamespace(held_out=HeldOutErrors(0.15, 0.15, {0: 0.1, 1: 0.3}))
    assert (
        evidence_against(before, [SimpleNamespace(material=after, light={0: 1.0, 1: 1 / 3})])
        is None
    )
    said = evidence_against(before, [SimpleNamespace(material=after, light={0: 1.0, 1: 1.0})])
    assert said is not None and "from 10.0 % to 17.3 %" in said.evidence


def test_a_material_that_could_not_be_fitted_again_says_nothing():
    none = SimpleNamespace(material=None, light={})
    assert evidence_against(with_errors(0.1), [none]) is None


@dataclass(frozen=True)
class Material:
    warnings: tuple[str, ...]


@dataclass(frozen=True)
class Result:
    materials: tuple[Material, ...]
    effects: tuple[str, ...] = ()


@pytest.mark.parametrize(
    ("order", "guilty"),
    [
        (["near_light", "camera_response"], ["camera_response"]),
        (["near_light", "camera_response", "vignetting"], ["camera_response"]),
        (["camera_response", "vignetting"], ["camera_response"]),
        (["camera_response", "vignetting", "near_light"], ["camera_response", "near_light"]),
        (["camera_response"], ["camera_response"]),
    ],
)
@pytest.mark.parametrize("of_cause", [True, False])
def test_what_unseen_photos_speak_against_is_left_out(monkeypatch, order, guilty, of_cause):
    """Second fits are refused that have a guilty cause in them. Those that gained less are tried
    without first; what was left out in vain is put back."""
    chosen = [SimpleNamespace(effect=SimpleNamespace(cause=name)) for name in order]
    monkeypatch.setattr(refit_job, "correctable_effects", lambda found: chosen)
    monkeypatch.setattr(refit_job, "_applied", lambda trial, model: trial.effect.cause)
    fractions = []

    def fitted(self, before, found, taken, done):
        fractions.append(done)
        yield Step("fitting", done)
        again = [Refit(Material(("again",)), {}, ())]
        evidence_against = any(t.effect.cause in guilty for t in taken)
        refusal = Rejection("Errors grow by 8 %.", of_cause) if evidence_against else None
        return again, SimpleNamespace(model=None), refusal

    monkeypatch.setattr(refit_job.RefitJob, "_with", fitted)
    checked = SimpleNamespace(result=Result((Material(("first",)),)), found=SimpleNamespace())
    job = refit_job.RefitJob(checked, portable=False)
    job.drain()
    told, other = (job.contradicted, job.unused) if of_cause else (job.unused, job.contradicted)
    assert told == dict.fromkeys(guilty, "Errors grow by 8 %.") and not other
    sound = tuple(name for name in order if name not in guilty)
    assert job.result.effects == sound
    said = job.result.materials[0].warnings
    assert said[0] == ("again" if sound else "first")
    assert set(said[1:]) == {
        f"The cause {c} is not included in the model. Errors grow by 8 %." for c in guilty
    }
    assert fractions == sorted(fractions) and max(fractions) < 1
