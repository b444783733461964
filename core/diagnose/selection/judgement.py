"""Which effect the photos support, if any.

The bars are the gains that captures without any hidden effect reach: simulated stereo meshes with
materials of no basis, and real photographs (docs/notebook/field-hunt.md). A name that is wrong
costs more than a missing one: weak evidence is only accepted where no unrelated effect has evidence
of its own that is nearly as strong.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace

import numpy as np

from .composed_effects import PARTS
from .cross_validation import standard_error_of_sum
from .evidence import Evidence
from .one_step import joint_step
from .trial import Trial

NAT = 1e-3  # the bars are thousandths of a nat a pixel and channel
MIN_GAINS: Mapping[str, float] = {
    "camera_response": 25.0, "near_light": 15.0, "light_direction": 4.0, "light_intensity": 8.0,
    "flash_offset": 1.5, "vignetting": 4.5, "cast_shadow": 0.5, "ambient_light": 4.5,
    "black_level": 4.5, "veiling_glare": 4.5, "environment_reflection": 4.5,
}  # fmt: skip
DEFAULT_MIN_GAIN = 10.0
"""Of an effect that is accepted: above the largest gain in captures without it. A flaked paint
looks like a tone curve; only lamps on the camera are insensitive to errors of the normals."""
MIN_RATIOS = (3.5, 2.5)
"""Standard errors of the gain over regions: of a weak gain, and of one that is strong, unrivalled,
shown by the background too, or of a spot, most of which may be in few regions."""
SPOTS = ("cast_shadow", "clipping", "anisotropy")
"""Effects on a small part of the photos: shadows and highlights."""
UNDERESTIMATED: Mapping[str, float] = {"anisotropy": 1.5}
"""Effects of which a step gains a small part of what a joint fit does, and the gain of a step from
which they are fitted jointly: a step cannot make a narrow highlight long. Measured: steps of 2.4 to
21 become 32 to 359 where a surface is brushed; steps of at most 2.1 become 5 where none is."""
UNRIVALLED = ("flash_offset",)  # nothing that a scan gets wrong looks like it
RIVAL_FRACTION = 0.5  # of the best gain, at which an unrelated effect makes weak evidence doubtful
SAME_EVIDENCE = 0.5  # overlap of gains above which two effects explain the same residual
NEARLY_BEST = 0.93  # fraction of the best gain at which the simpler effect is preferred
CLOSE, MAX_CONTENDERS = 0.75, 3  # fraction of the best gain at which an effect is fitted too
MIN_CONFIRMED = 0.5  # of the gain of a step, that the joint fit has to reach
TIE_STANDARD_ERRORS = 2.0  # difference of gains below which two effects are tied
COMMONER: Mapping[str, str] = {"black_level": "ambient_light"}
"""Of two causes that are tied, the one that is met more often: a raw converter subtracts the black
level, but few rooms are black."""
ALL_OF_IT = 0.9  # fraction of a gain that counts as all of it
FAMILIES = (
    ("ambient_light", "environment_reflection", "veiling_glare", "black_level", "subsurface",
     "interreflection"),
    ("light_direction", "near_light", "flash_offset"),
    ("near_light", "light_intensity"),
    ("camera_response", "clipping"),
)  # fmt: skip
"""Effects that imitate each other: light that is added everywhere, lamps that are elsewhere, and a
gain of each photo, which is part of a near lamp."""


def min_gain(cause: str) -> float:
    """Nats a pixel and channel that an effect has to gain."""
    return NAT * MIN_GAINS.get(cause, DEFAULT_MIN_GAIN)


def related(one: str, other: str) -> bool:
    """Whether two causes imitate each other."""
    return one == other or any(one in family and other in family for family in FAMILIES)


def overlap(one: Evidence, other: Evidence) -> float:
    """Fraction of the smaller gain that both effects explain: 1 the same residual, 0 each its
    own."""
    both = joint_step([one.step, other.step])
    smaller = max(min(one.step.gain, other.step.gain), 1e-9)
    return (one.step.gain + other.step.gain - both) / smaller


def contenders(evidence: Sequence[Evidence]) -> list[Evidence]:
    """The effects that are to be fitted jointly, best first; empty: none is convincing. The parts
    of an effect are fitted too, each alone. Where an unrelated effect has evidence too, weak
    evidence counts only for an unrivalled one, and for one that the background of the photos shows
    and those that imitate it. evidence: best first."""
    strong = [
        one
        for one in evidence
        if has_sufficient_evidence(one.trial)
        and not _is_composed(one, evidence)
        and not _is_imitation(one, evidence)
    ]
    if not strong:
        return []
    shown = [one.cause for one in strong if one.trial.is_shown]
    weak = not strong[0].trial.is_strong and strong[0].cause not in UNRIVALLED
    if weak and _has_rival(strong[0], strong):
        strong = [
            one
            for one in strong
            if one.cause in UNRIVALLED or any(related(one.cause, other) for other in shown)
        ]
        if not strong:
            return []
    close = [one for one in strong if one.trial.gain > CLOSE * strong[0].trial.gain]
    kept = [one for one in close if not any(_replaces(other, one) for other in close)]
    kept = kept[:MAX_CONTENDERS]
    also = {*UNRIVALLED, *shown, *(part for one in kept for part in PARTS.get(one.cause, ()))}
    also -= {one.cause for one in kept}
    return [*kept, *(one for one in strong if one.cause in also)]


def underestimated(evidence: Sequence[Evidence]) -> list[Evidence]:
    """The effects of which a step may have found a small part only: their joint fits decide."""
    return [
        one for one in evidence if one.trial.density > NAT * UNDERESTIMATED.get(one.cause, np.inf)
    ]


def confirmed(trials: Sequence[Trial], steps: Sequence[Evidence]) -> list[Trial]:
    """The joint fits with enough evidence, that gain what their steps promise. steps: of the same
    effects."""
    return [
        trial
        for trial, step in zip(trials, steps, strict=True)
        if has_sufficient_evidence(trial) and trial.gain > MIN_CONFIRMED * step.trial.gain
    ]


def best_of(trials: Sequence[Trial]) -> Trial | None:
    """Of the joint fits that come close to the best, the one that the background of the photos
    shows too; else the simplest that gains nearly as much, with its ties: many light sources can
    imitate uniform ambient light, which is one. None: no trial is accepted."""
    accepted = [trial for trial in trials if trial.is_accepted]
    if not accepted:
        return None
    most = max(trial.gain for trial in accepted)
    shown = [trial for trial in accepted if trial.is_shown and trial.gain > CLOSE * most]
    if shown:
        return max(shown, key=lambda trial: trial.gain)
    nearly = [trial for trial in accepted if trial.gain > NEARLY_BEST * most]
    best = min(nearly, key=lambda trial: (trial.effect.degrees_of_freedom, -trial.gain))
    tied = [trial for trial in accepted if trial is not best and _is_tie(trial, best)]
    commoner = [trial for trial in tied if COMMONER.get(best.effect.cause) == trial.effect.cause]
    if commoner:
        tied, best = [*(t for t in tied if t is not commoner[0]), best], commoner[0]
    return replace(best, ties=tuple(trial.effect for trial in tied))


def _is_composed(one: Evidence, evidence: Sequence[Evidence]) -> bool:
    """Whether the effects that are a part of an effect explain all that it explains."""
    parts = [other.step for other in evidence if other.cause in PARTS.get(one.cause, ())]
    return bool(parts) and joint_step(parts) > ALL_OF_IT * one.step.gain


def _replaces(simple: Evidence, other: Evidence) -> bool:
    """Whether a simpler effect of the same family gains nearly as much."""
    simpler = simple.step.effect.degrees_of_freedom < other.step.effect.degrees_of_freedom
    enough = simple.trial.gain > NEARLY_BEST * other.trial.gain
    return simpler and enough and related(simple.cause, other.cause)


def has_sufficient_evidence(trial: Trial) -> bool:
    """Whether the gain of a step or a joint fit is large, also relative to its standard error."""
    enough = trial.density > min_gain(trial.effect.cause)
    sure = trial.is_strong or trial.is_shown or trial.effect.cause in (*UNRIVALLED, *SPOTS)
    return enough and trial.ratio > MIN_RATIOS[sure]


def _is_imitation(one: Evidence, evidence: Sequence[Evidence]) -> bool:
    """Whether the evidence for an unrivalled effect may be that of an unrelated one that explains
    more of the residual, but whose own evidence is not sufficient: a tone curve is not named where
    a material could be the reason, and then neither is the flash that it looks like."""
    return one.cause in UNRIVALLED and any(
        other.trial.gain > one.trial.gain
        and other.trial.ratio > MIN_RATIOS[1]
        and not has_sufficient_evidence(other.trial)
        and not related(other.cause, one.cause)
        for other in evidence
    )


def _has_rival(best: Evidence, strong: Sequence[Evidence]) -> bool:
    """Whether an unrelated effect has convincing evidence of its own that is nearly as strong."""
    return any(
        one.trial.gain > RIVAL_FRACTION * best.trial.gain
        and not related(one.cause, best.cause)
        and overlap(one, best) < SAME_EVIDENCE
        for one in strong
    )


def _is_tie(trial: Trial, best: Trial) -> bool:
    """Whether an effect that is as simple explains the photos as well."""
    if trial.effect.degrees_of_freedom > best.effect.degrees_of_freedom:
        return False
    error = standard_error_of_sum(trial.by_region - best.by_region)
    return abs(trial.gain - best.gain) < TIE_STANDARD_ERRORS * error
