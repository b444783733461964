"""Fit one material to its samples, by the measured or the paper's method, in steps."""

from __future__ import annotations

from collections.abc import Generator
from dataclasses import dataclass
from functools import partial

from ..basis import Basis
from ..capture import Capture
from ..concurrency.background import in_background, steps_in_background
from ..fit import PaperFit, fit_paper
from ..fit.held_out import (
    HeldOutErrors,
    Judge,
    fit_without_photo,
    photos_to_hold_out,
    prediction_errors,
    summarise,
)
from ..fit.measured.estimate import measured_steps
from ..fit.measured_result import MeasuredResult
from ..fit.spread import Spread, candidate_spread
from ..samples import SampleTable

FIT_SHARE, HELD_OUT_SHARE = 0.95, 0.035  # of the time of an estimate, measured with the demo


@dataclass(frozen=True)
class Estimate:
    """A fit with its quality measures, of either method. held_out: errors on held-out photos, None
    where no photo was held out. notes: photos that could not be held out, sentences."""

    fit: PaperFit | MeasuredResult
    held_out: HeldOutErrors | None
    spread: Spread
    notes: tuple[str, ...] = ()


Steps = Generator[tuple[str, float], None, Estimate]


def estimate(
    table: SampleTable,
    basis: Basis,
    capture: Capture,
    name: str,
    judge: Judge | None = None,
    clipped: SampleTable | None = None,
) -> Steps:
    """Fit by the capture's method; yields (name of the next stage, fraction done).

    judge: predicts a held-out photo and measures the error (None: from the samples in ``table``).
    clipped: samples with a clipped channel, which the measured method uses as lower limits. Raises
    FitError.
    """
    if judge is None:
        judge = partial(prediction_errors, table)
    if capture.fit.method == "paper":
        return _paper(table, basis, capture, name, judge)
    return _measured(table, basis, capture, name, judge, clipped)


def _measured(
    table: SampleTable,
    basis: Basis,
    capture: Capture,
    name: str,
    judge: Judge,
    clipped: SampleTable | None,
) -> Steps:
    steps = steps_in_background(measured_steps(table, basis, clipped=clipped))
    while True:
        try:
            yield f"fitting {name}", FIT_SHARE * next(steps)
        except StopIteration as end:
            fit = end.value
            break
    held_out = photos_to_hold_out(table) if capture.fit.held_out else []
    parts = []
    for done, photo in enumerate(held_out):
        at = (
            f"predicting held-out photos of {name}",
            FIT_SHARE + HELD_OUT_SHARE * done / len(held_out),
        )
        yield at
        other = fit.without.pop(photo, None)  # frees it: once evaluated, each takes a megabyte
        if other is not None:
            parts.append((yield from in_background(partial(judge, photo, other), at)))
    yield f"estimating the uncertainty of {name}", FIT_SHARE + HELD_OUT_SHARE
    kept = MeasuredResult.of(fit)
    return Estimate(kept, summarise(parts), kept.band.spread())


def _paper(table: SampleTable, basis: Basis, capture: Capture, name: str, judge: Judge) -> Steps:
    yield f"fitting {name}", 0.0
    settings = capture.fit.paper
    fit = yield from in_background(
        lambda: fit_paper(table, basis, settings), (f"fitting {name}", 0.0)
    )
    held_out = photos_to_hold_out(table) if capture.fit.held_out else []
    parts = []
    for done, photo in enumerate(held_out):
        yield f"predicting held-out photos of {name}", 0.4 + 0.6 * done / len(held_out)
        parts.append(fit_without_photo(table, photo, basis, settings, judge))
    lost = [capture.photo_name(p) for p, part in zip(held_out, parts, strict=True) if part is None]
    return Estimate(
        fit=fit,
        held_out=summarise([part for part in parts if part is not None]),
        spread=candidate_spread(basis, fit.candidates),
        notes=(f"Not held out, because too few samples would remain: {', '.join(lost)}.",)
        if lost
        else (),
    )
