"""Which effects the photos ask for: tried one by one, the best accepted, then looked again.

An effect is judged by what the model with it predicts better of squares that neither was fitted to
(held_out.py), and by how likely chance would do the same (chance.py). In the end every accepted
effect has to be missed if it is taken out again.
"""

from __future__ import annotations

from collections.abc import Callable, Generator, Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import replace
from functools import cache, partial
from threading import Lock

import numpy as np
from numpy.typing import NDArray

from ..job.in_order import in_order
from .chance import Asked, asked
from .change import rms_change
from .dark_spots import DIM
from .deviation import as_found
from .effect import Effect, Setting
from .effects.outside_basis import OutsideBasis
from .fitted import Fitted
from .found import MINOR, SURE, Found, Trial
from .held_out import (
    by_square,
    error_of_sum,
    predict_unseen,
    squares,
    variances,
)
from .leftover import leftover
from .model import Model
from .solve import fit
from .unseen_error import unseen_error

Array = NDArray[np.floating]
Vector = NDArray[np.float64]
Costs = Callable[[bool, bool], Array]

OUTSIDE = 0.002  # RMS of the photos that the slack beside the basis has to explain to be named
MOST_EFFECTS = 4
NEARLY = 0.93  # of the best gain
TRIED, PROMISING = 4, 0.25  # so many are fitted at least; and all that promise this of the best
UNLIKELY = 0.05  # chance of effects of patches that are fitted
SURER = 5.0  # standard errors of a gain that is as small and leaves nothing
CASTS = 3  # rounds in which rays are cast anew for a lamp or a photo that is found elsewhere
MORE = 0.02  # of the gain, that another such round has to promise
EXPECTATIONS = 1  # rounds in which patches say what is usual among them
AGAINST = 2.0  # standard errors that a material loses by what a camera does: it should gain;
FEW = 10  # squares of it, that are too few to say so
ALIKE = 2.0  # standard errors by which gains differ that the photos cannot tell apart


def search(
    model: Model,
    deviation: Array,
    effects: Sequence[Effect],
    setting: Setting,
    pool: ThreadPoolExecutor | None = None,
) -> Generator[float, None, Found]:
    """Yields the fraction done. setting: that the effects were made for. pool: threads that try
    effects side by side."""
    now = fit(model, deviation)
    expected = deviation
    deviation = as_found(deviation, now.residual, now.shown, model.pixels)
    now = before = fit(now.model, deviation)
    accepted: list[Trial] = []
    rounds: list[tuple[Trial, ...]] = []
    left = list(effects)
    refused: dict[str, float] = {}
    for turn in range(MOST_EFFECTS):
        yield turn / MOST_EFFECTS
        trials, costs = [], _costs(now)
        promising = [
            one
            for one in _promising(asked(now, left, pool))
            if one.gain > refused.get(one.effect.cause, -np.inf)
        ]
        tried = in_order(pool, partial(_try, now, costs), promising, ahead=len(promising))
        for place, (one, trial) in enumerate(zip(promising, tried, strict=True)):
            trials.append(trial)
            if trial.gain < 0:  # once is enough, unless it promises more
                refused[one.effect.cause] = one.gain
            yield (turn + (place + 1) / (len(promising) + 1)) / MOST_EFFECTS
        trials.sort(key=lambda t: -t.gain)
        rounds.append(tuple(trials))
        best = _simplest([t for t in trials if t.sure and not t.against])
        gained = sum(t.gain for t in accepted)
        if best is None or not best.convincing:
            break
        if best.effect.of_brdf:
            best = replace(_remade(now, costs, best, setting), ties=best.ties)
        best = _with_rays(now, costs, best, setting)
        if best.gain < MINOR * gained and not _settles(best):
            break
        accepted.append(best)
        now = best.fitted
        left = [e for e in left if e.cause != best.effect.cause]
    now, kept = _missed(before, now, accepted, pool)
    # what is missed most first
    kept = tuple(sorted((trial.by_photos() for trial in kept), key=lambda t: -t.gain))
    kept = (*kept, *_outside(now, kept))
    unseen = predict_unseen(before), predict_unseen(now)
    return Found(
        kept, tuple(rounds), before, now, *unseen,
        leftover(now),
        unseen_error(before, unseen[0], expected), unseen_error(now, unseen[1], expected),
        expected, _contradicted(rounds[0], kept, setting.materials),
    )  # fmt: skip


def _settles(trial: Trial) -> bool:
    """Whether nothing is left with it: the model of what was accepted before lacks nothing, and it
    is not that which it stands for."""
    return trial.gain > SURER * trial.error and leftover(trial.fitted).gain < 0


def _promising(found: Sequence[Asked]) -> list[Asked]:
    """Worth a fit: those that promise most."""
    few = [a for a in found if a.effect.patch is None and np.isfinite(a.gain)]
    most = max((a.gain for a in few), default=0.0)
    chosen = []
    for one in found:
        if one.effect.patch is not None:
            worth = one.chance < UNLIKELY
        else:
            worth = one.gain >= PROMISING * most or any(one is f for f in few[:TRIED])
        chosen += [one] if worth else []
    return chosen


def _simplest(trials: Sequence[Trial]) -> Trial | None:
    """Of convincing trials, best first, the simplest that gains nearly as much as the best: many
    spots of light can stand for an even room, which is one thing."""
    if not trials:
        return None
    most = max(t.gain for t in trials)
    enough = [t for t in trials if t.gain > NEARLY * most]
    best = min(enough, key=lambda t: t.effect.freedom)
    same = [
        t.effect
        for t in trials
        if t is not best
        and t.effect.freedom <= best.effect.freedom
        and t.effect.fine == best.effect.fine
        and abs(t.gain - best.gain) < ALIKE * error_of_sum(t.by_block - best.by_block)
    ]
    return replace(best, ties=tuple(same))


def _try(now: Fitted, costs: Costs, one: Asked) -> Trial:
    """costs: _costs(now)."""
    effect, fine = one.effect, one.effect.fine
    # beside it the numbers of other patches stay as they are, and so they must without it: those
    # of a square that is left out are known then too
    settled = effect.patch is not None and now.model.patchy is not None
    fitted = fit(
        now.model.with_effect(effect, effect.guess(_missed_where_bright(now), now.shown)),
        now.deviation,
    )
    for _ in range(EXPECTATIONS if effect.patch is not None else 0):
        effect = effect.expecting(_usual(fitted))
        model = now.model.with_effect(effect)
        fitted = fit(replace(model, brdfs=fitted.model.brdfs, x=fitted.model.x), now.deviation)
    unseen = predict_unseen(fitted, fine)
    # what is confined to a few squares could never be sure
    gained = by_square(squares(now, fine), costs(fine, settled) - unseen.cost)
    own = effect.patch is None and len(effect.numbers) > 0
    without = fitted.model.without(effect.cause) if own else now.shown
    change = rms_change(fitted.shown, without, now.deviation, effect.of_highlights)
    against = _against(now, costs(fine, settled) - unseen.cost) if effect.of_camera else ()
    return Trial(effect, fitted, unseen, gained, change, one.chance, against=against)


def _against(now: Fitted, gains: Array) -> tuple[int, ...]:
    """Materials of which left-out squares are predicted worse."""
    material = now.model.pixels.material
    found = []
    for index in np.unique(material):
        mine = np.flatnonzero(material == index)
        gained = by_square(squares(now)[mine], gains[mine])
        if len(gained) > FEW and gained.sum() < -AGAINST * error_of_sum(gained):
            found.append(int(index))
    return tuple(found)


def _contradicted(
    tried: Sequence[Trial], kept: Sequence[Trial], materials: Sequence[str]
) -> dict[str, str]:
    """By cause, what speaks against those that gain but by one material at another's expense."""
    accepted = {trial.effect.cause for trial in kept}
    return {
        t.effect.cause: "a camera does the same to all materials, but with it parts of "
        f"{' and '.join(materials[k] for k in t.against)} that were left out are predicted worse"
        for t in tried
        if t.against and t.sure and t.effect.cause not in accepted
    }


def _with_last(model: Model, effect: Effect, x: Vector) -> Array:
    """(n, 3) what the model shows where its last effect is this one."""
    last = replace(model, effects=(*model.effects[:-1], effect), x=(*model.x[:-1], x))
    return last.predicted()


def _remade(now: Fitted, costs: Costs, best: Trial, setting: Setting) -> Trial:
    """With the BRDFs that are found when the effect is in the model: those without it hold a part
    of it. In finer detail where that gains more."""
    setting = replace(setting, brdfs=best.fitted.model.brdfs)
    effects = [best.effect.remade(setting, best.x)]
    if len(effects[0].numbers) != len(best.effect.numbers):
        plain = best.effect.of(setting)
        effects += [] if plain is None else [plain]
    tried = [_try(now, costs, Asked(effect, best.gain, best.chance)) for effect in effects]
    return max(tried, key=lambda trial: trial.gain)


def _with_rays(now: Fitted, costs: Costs, best: Trial, setting: Setting) -> Trial:
    """With shadows away from where it puts the lamp, and the surface that photos show where it puts
    them, if it moves either."""
    for _ in range(CASTS):
        x = best.effect.sought(setting, best.x, partial(_with_last, best.fitted.model))
        effect = best.effect.casting(setting, x)
        if effect is best.effect:
            break
        again = _try(now, costs, Asked(effect, best.gain, best.chance))
        if again.gain < best.gain:  # the mesh is too coarse to say where they end
            break
        settled = again.gain < (1 + MORE) * best.gain
        best = replace(again, ties=best.ties)
        if settled:
            break
    return best


def _costs(now: Fitted) -> Costs:
    """(n,) of the model as it is, found when they are asked for, and once: where large squares are
    left out (False), or single pixels; whether the numbers of patches stay as they are."""
    one_at_a_time = Lock()

    @cache
    def costs(fine: bool, settled: bool) -> Array:
        base = replace(now, model=now.model.settled()) if settled else now
        return predict_unseen(base, fine).cost

    def locked(fine: bool, settled: bool) -> Array:
        with one_at_a_time:
            return costs(fine, settled)

    return locked


def _outside(now: Fitted, kept: Sequence[Trial]) -> list[Trial]:
    """What the slack beside the basis gains: much of it means that no mixture of the measured
    materials reflects so."""
    model = now.model
    if any(isinstance(e, OutsideBasis) for e in model.effects):
        return []
    tight = fit(replace(model, brdfs=model.brdfs.tight()), now.deviation)
    unseen = predict_unseen(now)
    gains = predict_unseen(tight).cost - unseen.cost
    change = rms_change(now.shown, tight.shown, now.deviation)
    effect = OutsideBasis()
    effects, x = (*model.effects, effect), (*model.x, np.zeros(0))
    said = replace(now, model=replace(model, effects=effects, x=x))
    unseen = replace(unseen, variance=(*unseen.variance, np.zeros(0)))
    trial = Trial(effect, said, unseen, by_square(squares(now), gains), change, 0.0)
    gained = sum(t.gain for t in kept)
    sure = trial.gain > max(SURE * trial.error, MINOR * gained)
    return [trial] if sure and change > OUTSIDE else []


def _missed_where_bright(now: Fitted) -> Array:
    """(n, 3) what the photos show more than the prediction, 0 where that is dark or clipped."""
    bright = now.shown > DIM * np.percentile(now.shown, 90)
    seen = bright & np.isfinite(now.deviation)
    return np.where(seen, now.model.pixels.observed - now.shown, 0.0)


def _usual(fitted: Fitted) -> Vector:
    """(e,) deviation of the numbers of patches as they are found: squares of what was found and of
    what is not known of it (a step of expectation and maximisation)."""
    model = fitted.model
    assert model.patchy is not None
    variance = variances(fitted)[model.patchy]
    patch = model.effects[model.patchy].patch
    assert patch is not None
    each = (np.square(model.x[model.patchy]) + variance).reshape(int(patch.max()) + 1, -1)
    return np.asarray(np.maximum(np.sqrt(each.mean(axis=0)), 1e-3))


def _missed(
    before: Fitted, now: Fitted, accepted: Sequence[Trial], pool: ThreadPoolExecutor | None
) -> tuple[Fitted, tuple[Trial, ...]]:
    """The model without those effects that it predicts as well without, and the trials of the rest:
    what each gains in the whole model."""
    kept = list(accepted)

    def anew(trial: Trial) -> Trial:
        others = before.model
        for other in kept:
            if other is not trial:
                others = others.with_effect(other.effect, other.x)
        without = fit(others, now.deviation)
        found = _try(without, _costs(without), Asked(trial.effect, 0.0, trial.chance))
        return replace(found, ties=trial.ties)

    while len(kept) > 1:
        again = list(in_order(pool, anew, kept, ahead=len(kept)))
        worst = min(range(len(kept)), key=lambda k: (not again[k].against, again[k].gain))
        if again[worst].convincing:
            return again[worst].fitted, tuple(again)
        kept.pop(worst)
    if len(kept) == len(accepted):
        return now, tuple(kept)
    alone = _try(before, _costs(before), Asked(kept[0].effect, 0.0, kept[0].chance))
    if alone.against:
        return before, ()
    return alone.fitted, (replace(alone, ties=kept[0].ties),)
