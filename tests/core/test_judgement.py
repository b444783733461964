"""Which effect the evidence supports: weak evidence needs to stand alone, and an effect that is
composed of others needs evidence of its own."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
import pytest

from patina.core.diagnose.effects.base.effect import Effect
from patina.core.diagnose.effects.base.parameters import Parameters
from patina.core.diagnose.effects.base.shown_by_background import ShownByBackground
from patina.core.diagnose.selection.evidence import Evidence
from patina.core.diagnose.selection.judgement import (
    best_of,
    confirmed,
    contenders,
    min_gain,
    underestimated,
)
from patina.core.diagnose.selection.one_step import OneStep, joint_step
from patina.core.diagnose.selection.trial import STRONG_GAIN, Trial
from patina.core.statistics.student_t import robust_cost, robust_weights

PIXELS, REGIONS = 4000, 100
REGION = np.arange(PIXELS) % REGIONS
RNG = np.random.default_rng(3)
PATTERNS = np.linalg.qr(RNG.normal(size=(PIXELS * 3, 6)))[0].T.reshape(6, PIXELS, 3)
NOISE = 0.3 * RNG.normal(size=(PIXELS, 3))


@dataclass(frozen=True)
class Pattern(Effect):
    """An effect that adds some of PATTERNS."""

    cause: str
    count: int
    deciding_photo = "a photo"

    @classmethod
    def of(cls, context):
        raise NotImplementedError

    @property
    def parameters(self) -> Parameters:
        return Parameters.alike([str(k) for k in range(self.count)], "", 100.0, -1e3, 1e3)

    def sentence(self, x, error) -> str:
        return self.cause


def evidence(cause: str, patterns, residual) -> Evidence:
    """By least squares with robust costs; patterns: numbers of PATTERNS."""
    left = np.moveaxis(PATTERNS[list(patterns)], 0, 2).astype(np.float32)
    x = np.linalg.lstsq(left.reshape(-1, len(patterns)), residual.ravel(), rcond=None)[0]
    effect = Pattern(cause, len(patterns))
    none = np.zeros((0, 0))
    step = OneStep(
        effect, x, none, effect.parameters.deviation, 0.0, 0.02, left, none,
        residual.astype(np.float32), robust_weights(residual), np.ones(len(x), bool),
    )  # fmt: skip
    saved = (robust_cost(residual) - robust_cost(residual - left @ x)).sum(axis=1)
    by_region = np.bincount(REGION, saved)
    trial = Trial(effect, x, np.ones(len(x)), by_region, residual.size, 0.02, 0.0)
    return Evidence(replace(step, gain=joint_step([step])), trial)


def residual_of(**gains: float):
    """(n, 3) noise and patterns p0, p1 …, each of a gain in nats a value."""
    parts = [
        np.sqrt(2 * gain * PIXELS * 3 / 1.25) * PATTERNS[int(name[1:])]
        for name, gain in gains.items()
    ]
    return NOISE + sum(parts)


def ranked(*found: Evidence) -> list[Evidence]:
    return sorted(found, key=lambda one: -one.trial.gain)


def causes(found) -> list[str]:
    return [one.cause for one in found]


def test_nothing_is_found_in_noise():
    found = ranked(*(evidence(c, [k], NOISE) for k, c in enumerate(["vignetting", "clipping"])))
    assert contenders(found) == []


def test_evidence_above_its_bar_is_found_alone():
    weak = residual_of(p0=2 * min_gain("vignetting"))
    found = ranked(evidence("vignetting", [0], weak), evidence("subsurface", [1], weak))
    assert causes(contenders(found)) == ["vignetting"]


def test_weak_evidence_beside_an_unrelated_rival_names_nothing():
    both = residual_of(p0=2 * min_gain("subsurface"), p1=1.6 * min_gain("subsurface"))
    found = ranked(evidence("vignetting", [0], both), evidence("subsurface", [1], both))
    assert contenders(found) == []


def test_strong_evidence_is_found_beside_a_rival():
    both = residual_of(p0=2 * STRONG_GAIN, p1=1.4 * STRONG_GAIN)
    found = ranked(evidence("vignetting", [0], both), evidence("subsurface", [1], both))
    assert causes(contenders(found)) == ["vignetting"]


@pytest.mark.parametrize("own", [False, True])
def test_a_near_light_needs_more_than_its_parts_explain(own):
    """Direction and intensity are patterns 0 and 1; the falloff of a near lamp is pattern 2."""
    size = 2 * min_gain("near_light")
    residual = residual_of(p0=size, p1=size, **({"p2": 2 * size} if own else {}))
    found = ranked(
        evidence("near_light", [0, 1, 2], residual),
        evidence("light_direction", [0], residual),
        evidence("light_intensity", [1], residual),
    )
    tried = causes(contenders(found))
    assert ("near_light" in tried) == own
    assert {"light_direction", "light_intensity"} <= set(tried) or not own


def test_a_flash_elsewhere_is_always_fitted():
    """No error of a scan looks like it, so it is compared with what gains more in one step."""
    both = residual_of(p0=2 * STRONG_GAIN, p1=10 * min_gain("flash_offset"))
    found = ranked(evidence("light_intensity", [0], both), evidence("flash_offset", [1], both))
    assert causes(contenders(found)) == ["light_intensity", "flash_offset"]


def test_weak_evidence_does_not_hide_a_flash_elsewhere():
    both = residual_of(p0=2 * min_gain("vignetting"), p1=1.5 * min_gain("vignetting"))
    found = ranked(evidence("vignetting", [0], both), evidence("flash_offset", [1], both))
    assert causes(contenders(found)) == ["flash_offset"]


def test_a_step_that_underestimates_is_followed_by_a_joint_fit():
    """A step towards an anisotropic highlight gains a small part of what a joint fit does."""
    both = residual_of(p0=0.3 * min_gain("anisotropy"), p1=0.3 * min_gain("vignetting"))
    found = ranked(evidence("anisotropy", [0], both), evidence("vignetting", [1], both))
    assert contenders(found) == []
    assert causes(underestimated(found)) == ["anisotropy"]
    nothing = ranked(evidence("anisotropy", [0], NOISE), evidence("vignetting", [1], both))
    assert underestimated(nothing) == []


@dataclass(frozen=True)
class Shown(Pattern, ShownByBackground):
    """An effect that the background shows, too."""

    def in_background(self, x):
        raise NotImplementedError

    def is_shown(self, x) -> bool:
        return True


def shown(one: Evidence | Trial, count: int):
    """The same evidence or joint fit, of an effect that the background shows."""
    trial = one if isinstance(one, Trial) else one.trial
    trial = replace(trial, effect=Shown(trial.effect.cause, count))
    return trial if isinstance(one, Trial) else replace(one, trial=trial)


def test_weak_evidence_that_the_background_shows_is_found_beside_a_rival():
    both = residual_of(p0=2 * min_gain("black_level"), p1=2.2 * min_gain("vignetting"))
    black, rival = evidence("black_level", [0], both), evidence("vignetting", [1], both)
    assert contenders(ranked(black, rival)) == []
    assert causes(contenders(ranked(shown(black, 1), rival))) == ["black_level"]


def test_the_background_decides_between_black_level_and_ambient_light():
    black, ambient = _tried("black_level", 3, 100.0), _tried("ambient_light", 3, 100.01)
    best = best_of([black, ambient])
    assert best is not None and best.effect.cause == "ambient_light" and len(best.ties) == 1
    best = best_of([shown(black, 3), ambient])
    assert best is not None and best.effect.cause == "black_level" and not best.ties
    much = _tried("ambient_light", 3, 150.0)
    best = best_of([shown(black, 3), much])
    assert best is not None and best.effect.cause == "ambient_light"


def test_an_effect_that_the_background_shows_may_change_the_object_little():
    small = replace(_tried("black_level", 3, 100.0), change=0.003)
    assert not small.is_accepted and shown(small, 3).is_accepted


def test_a_flash_that_a_tone_curve_imitates_is_not_fitted():
    """The curve explains more, but less than flaked paints without a curve do."""
    both = residual_of(p0=0.5 * min_gain("camera_response"), p1=2 * min_gain("flash_offset"))
    found = ranked(evidence("camera_response", [0], both), evidence("flash_offset", [1], both))
    assert contenders(found) == []


@pytest.mark.parametrize(
    ("gain", "accepted"), [(2 * STRONG_GAIN, True), (0.5 * STRONG_GAIN, False)]
)
def test_a_strong_gain_may_predict_a_few_highlights_worse(gain, accepted):
    trial = replace(_tried("vignetting", 1, 1000 * gain), growth=1.05)
    assert trial.is_accepted == accepted
    assert not replace(trial, growth=1.2).is_accepted


def test_a_joint_fit_without_enough_evidence_does_not_hide_another():
    """The larger gain is in few regions, and so hardly more than its standard error."""
    gain = 5 * min_gain("vignetting") * 1000
    few = np.zeros(REGIONS)
    few[:6] = 2 * gain / 6
    trials = [replace(_tried("subsurface", 1, 1.0), by_region=few), _tried("vignetting", 1, gain)]
    steps = [evidence(trial.effect.cause, [0], NOISE) for trial in trials]
    best = best_of(confirmed(trials, steps))
    assert best is not None and best.effect.cause == "vignetting"


@pytest.mark.parametrize(("share", "kept"), [(0.4, 0), (0.6, 1)])
def test_a_joint_fit_gains_at_least_half_of_what_its_step_promises(share, kept):
    step = evidence("vignetting", [0], residual_of(p0=20 * min_gain("vignetting")))
    trial = replace(_tried("vignetting", 1, share * step.trial.gain), values=step.trial.values)
    assert len(confirmed([trial], [step])) == kept


def _tried(cause: str, count: int, gain: float) -> Trial:
    by_region = np.full(REGIONS, gain / REGIONS) + 1e-3 * RNG.normal(size=REGIONS)
    effect = Pattern(cause, count)
    return Trial(effect, np.ones(count), np.ones(count), by_region, 1000, 0.02, 0.0)


@pytest.mark.parametrize(("x", "distinct"), [([0.5, -1.9], False), ([0.5, -2.1], True)])
def test_parameters_that_may_all_be_0_are_not_distinct(x, distinct):
    trial = replace(_tried("vignetting", 2, 1.0), x=np.array(x))
    assert trial.is_distinct == distinct


@pytest.mark.parametrize(("x", "distinct"), [([0.5, 0.6], False), ([0.5, -0.1], True)])
def test_parameters_that_are_uncertain_each_can_be_distinct_together(x, distinct):
    """The sum of both is unknown, their difference is known to 0.2."""
    correlation = np.array([[1.0, 0.98], [0.98, 1.0]])
    trial = replace(_tried("vignetting", 2, 1.0), x=np.array(x), correlation=correlation)
    assert trial.is_distinct == distinct


def test_directions_that_are_not_identifiable_do_not_make_parameters_distinct():
    """Gains of three photos relative to their mean: the common gain has no variance."""
    correlation = np.array([[1.0, -0.5, -0.5], [-0.5, 1.0, -0.5], [-0.5, -0.5, 1.0]])
    trial = replace(_tried("light_intensity", 3, 1.0), correlation=correlation)
    assert not replace(trial, x=np.array([0.9, -0.5, -0.4])).is_distinct
    assert replace(trial, x=np.array([2.6, -1.3, -1.3])).is_distinct


def test_the_simpler_of_two_nearly_equal_effects_is_chosen():
    best = best_of([_tried("environment_reflection", 64, 100.0), _tried("ambient_light", 3, 96.0)])
    assert best is not None and best.effect.cause == "ambient_light"


def test_a_room_is_commoner_than_lifted_blacks():
    best = best_of([_tried("black_level", 3, 100.0), _tried("ambient_light", 3, 100.0)])
    assert best is not None and best.effect.cause == "ambient_light"
    assert [effect.cause for effect in best.ties] == ["black_level"]


def test_one_certain_parameter_among_many_is_distinct():
    x = np.zeros(20)
    x[7] = 5.0
    trial = replace(_tried("environment_reflection", 20, 1.0), x=x, correlation=np.eye(20))
    assert trial.is_distinct


def test_a_parameter_at_a_limit_is_distinct():
    """It has no variance there."""
    trial = replace(_tried("subsurface", 1, 1.0), x=np.array([1.5]), variance=np.zeros(1))
    assert replace(trial, correlation=np.zeros((1, 1))).is_distinct
