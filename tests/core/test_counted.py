"""Counts in sentences."""

from __future__ import annotations

from patina.core.counted import counted
from patina.core.diagnose.effects import EFFECTS
from patina.core.diagnose.effects.actions import ACTIONS
from patina.core.diagnose.effects.labels import LABELS, ORIGINS, cause_label, origin_of


def test_only_one_is_singular() -> None:
    assert [counted(n, "photo") for n in (0, 1, 2, 1200)] == [
        "0 photos",
        "1 photo",
        "2 photos",
        "1,200 photos",
    ]
    assert counted(2, "axis", "axes") == "2 axes"


def test_every_cause_has_a_label() -> None:
    assert {effect.cause for effect in EFFECTS} <= set(LABELS)


def test_every_cause_has_one_origin() -> None:
    placed = [cause for causes in ORIGINS.values() for cause in causes]
    assert sorted(placed) == sorted({effect.cause for effect in EFFECTS})
    assert origin_of("vignetting") == "Camera"
    assert origin_of("a cause of a later version") == "Other"


def test_every_cause_has_an_action() -> None:
    assert {effect.cause for effect in EFFECTS} == set(ACTIONS)
    assert all(action.endswith(".") and ". " not in action for action in ACTIONS.values())
    assert cause_label("camera_pose") == "Wrong Camera Poses"
