"""The second fit is accepted only where it predicts held-out photos no worse."""

from __future__ import annotations

from dataclasses import dataclass
from types import SimpleNamespace

import pytest

from patina.core.concurrency.job import Step
from patina.core.fit.held_out import HeldOutErrors
from patina.core.jobs import refit_job
from patina.core.jobs.acceptance import Refit, Rejection, evidence_against


def with_errors(*errors: float | None) -> list[SimpleNamespace]:
    """Materials whose three held-out photos have these relative errors."""
    return [
        SimpleNamespace(
            name=f"material {k}",
            held_out=None if e is None else HeldOutErrors(e, e, dict.fromkeys(range(3), e)),
        )
        for k, e in enumerate(errors, 1)
    ]


def again(*errors: float | None, light: float = 1.0) -> list[SimpleNamespace]:
    """The same for second fits, as a fraction of each photo's light."""
    by_photo = dict.fromkeys(range(3), light)
    return [SimpleNamespace(material=m, light=by_photo) for m in with_errors(*errors)]


def test_worse_held_out_prediction_is_rejected_with_figures():
    reason = evidence_against(with_errors(0.10, 0.20), again(0.12, 0.20))
    assert reason is not None and reason.of_cause
    assert "increases from 10.0 % to 12.0 % for material 1" in reason.evidence
    assert "stays at 20.0 % for material 2" in reason.evidence


@pytest.mark.parametrize("after", [(0.05, 0.2), (0.1, 0.2), (0.101, 0.2), (None, None)])
def test_better_equal_or_unknown_prediction_is_accepted(after):
    assert evidence_against(with_errors(0.1, 0.2), again(*after)) is None


def test_single_photo_does_not_decide():
    """The worst photo has twice the error; all others improve."""
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


def test_joint_evidence_of_materials_and_causes_decides():
    """A few percent worse for the second fit alone, but much better, or not, where materials and
    causes are fitted jointly.
    """
    before, after = with_errors(0.1), again(0.105)
    assert evidence_against(before, after) is not None
    assert evidence_against(before, after, jointly=-0.15) is None
    assert evidence_against(before, after, jointly=-0.01) is not None


def test_cause_is_kept_when_only_joint_fit_improves():
    """A wide lamp: the joint fit is far better, although the corrected samples alone give a worse
    fit.
    """
    # the last one is worse by more than the joint fit is better
    for error, jointly in ((0.12, -1.0), (0.12, -0.2), (0.15, -0.2)):
        reason = evidence_against(with_errors(0.1), again(error), jointly=jointly)
        assert reason is not None and not reason.of_cause
    assert evidence_against(with_errors(0.1), again(0.12)).of_cause


def test_errors_are_relative_to_original_light():
    """Light that was subtracted leaves the same absolute error of less light."""
    assert evidence_against(with_errors(0.1), again(0.13, light=0.7)) is None
    assert evidence_against(with_errors(0.1), again(0.13, light=0.9)) is not None


def test_each_photo_is_judged_relative_to_its_own_light():
    """Most light in the dark photo is ambient.

    The error there is the same fraction of all its light as before, which is three times as large a
    fraction of the lamp's light.
    """
    before = [SimpleNamespace(name="clay", held_out=HeldOutErrors(0.1, 0.1, {0: 0.1, 1: 0.1}))]
    after = SimpleNamespace(held_out=HeldOutErrors(0.15, 0.15, {0: 0.1, 1: 0.3}))
    assert (
        evidence_against(before, [SimpleNamespace(material=after, light={0: 1.0, 1: 1 / 3})])
        is None
    )
    reason = evidence_against(before, [SimpleNamespace(material=after, light={0: 1.0, 1: 1.0})])
    assert reason is not None and "from 10.0 % to 17.3 %" in reason.evidence


def test_material_without_second_fit_is_ignored():
    none = SimpleNamespace(material=None, light={})
    assert evidence_against(with_errors(0.1), [none]) is None


@dataclass(frozen=True)
class Material:
    warnings: tuple[str, ...]


@dataclass(frozen=True)
class Result:
    materials: tuple[Material, ...]
    effects: tuple[str, ...] = ()


def named(cause: str, is_distinct: bool = True) -> SimpleNamespace:
    """A cause of a diagnosis."""
    return SimpleNamespace(effect=SimpleNamespace(cause=cause), is_distinct=is_distinct)


def diagnosed(variation) -> SimpleNamespace:
    """A finished diagnosis. variation: that its baseline knows."""
    return SimpleNamespace(
        result=Result((Material(("first",)),)), found=SimpleNamespace(),
        context=SimpleNamespace(variation=variation),
    )  # fmt: skip


def test_samples_without_variation_are_judged_by_a_fit_to_the_same_samples(monkeypatch):
    """The error of the first fit contains the texture; without that, any cause would do."""
    monkeypatch.setattr(refit_job, "correctable_effects", lambda found: [named("vignetting")])
    monkeypatch.setattr(refit_job, "_applied", lambda trial, model: trial.effect.cause)

    def fits(self, before, found, taken, done):
        yield Step("fitting", done)
        causes = ", ".join(trial.effect.cause for trial in taken)
        return [Refit(Material((causes,)), {}, ())], SimpleNamespace(model=None)

    compared = []

    def evidence(before, after, jointly):
        compared.append((before[0].warnings, after[0].material.warnings))

    monkeypatch.setattr(refit_job.RefitJob, "_fits", fits)
    monkeypatch.setattr(refit_job, "evidence_against", evidence)
    monkeypatch.setattr(refit_job, "joint_log_growth", lambda found, fitted: 0.0)
    for variation in (None, SimpleNamespace()):
        refit_job.RefitJob(diagnosed(variation), portable=False).drain()
    assert compared == [(("first",), ("vignetting",)), (("",), ("vignetting",))]


def test_causes_whose_parameters_may_be_0_are_contradicted(monkeypatch):
    accepted = [named("flash_offset"), named("veiling_glare", is_distinct=False)]
    monkeypatch.setattr(refit_job, "correctable_effects", lambda found: accepted)
    monkeypatch.setattr(refit_job, "_applied", lambda trial, model: trial.effect.cause)

    def fitted(self, before, judged, found, taken, done):
        yield Step("fitting", done)
        return [Refit(Material(("again",)), {}, ())], SimpleNamespace(model=None), None

    monkeypatch.setattr(refit_job.RefitJob, "_with", fitted)
    checked = diagnosed(variation=None)
    job = refit_job.RefitJob(checked, portable=False)
    job.drain()
    assert job.result.effects == ("flash_offset",)
    assert list(job.contradicted) == ["veiling_glare"]


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
def test_causes_that_worsen_held_out_photos_are_removed(monkeypatch, order, guilty, of_cause):
    """Second fits that contain a guilty cause are rejected.

    Causes of smaller gain are removed first; causes whose removal does not help are restored.
    """
    accepted = [named(name) for name in order]
    monkeypatch.setattr(refit_job, "correctable_effects", lambda found: accepted)
    monkeypatch.setattr(refit_job, "_applied", lambda trial, model: trial.effect.cause)
    fractions = []

    def fitted(self, before, judged, found, taken, done):
        fractions.append(done)
        yield Step("fitting", done)
        again = [Refit(Material(("again",)), {}, ())]
        evidence_against = any(t.effect.cause in guilty for t in taken)
        refusal = Rejection("Errors grow by 8 %.", of_cause) if evidence_against else None
        return again, SimpleNamespace(model=None), refusal

    monkeypatch.setattr(refit_job.RefitJob, "_with", fitted)
    checked = diagnosed(variation=None)
    job = refit_job.RefitJob(checked, portable=False)
    job.drain()
    reported, other = (job.contradicted, job.unused) if of_cause else (job.unused, job.contradicted)
    assert reported == dict.fromkeys(guilty, "Errors grow by 8 %.") and not other
    sound = tuple(name for name in order if name not in guilty)
    assert job.result.effects == sound
    reason = job.result.materials[0].warnings
    assert reason[0] == ("again" if sound else "first")
    assert set(reason[1:]) == {
        f"The cause {c} is not included in the model. Errors grow by 8 %." for c in guilty
    }
    assert fractions == sorted(fractions) and max(fractions) < 1
