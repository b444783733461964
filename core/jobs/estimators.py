"""One material's samples → what its fit found, by either method, in steps."""

from __future__ import annotations

from collections.abc import Generator
from dataclasses import dataclass
from functools import partial

from ..basis import Basis
from ..capture import Capture
from ..concurrency.background import in_background, steps_in_background
from ..fit import PaperFit, fit_paper
from ..fit.held_out import (
    HeldOut,
    Judge,
    leave_out,
    photos_to_hold_out,
    predicted,
    summarise,
)
from ..fit.measured.estimate import measured_steps
from ..fit.measured_result import MeasuredResult
from ..fit.spread import Spread, candidate_spread
from ..samples import SampleTable


@dataclass(frozen=True)
class Estimate:
    """By either method. held_out: None where nothing was held out. notes: what the holding out
    itself ran into."""

    fit: PaperFit | MeasuredResult
    held_out: HeldOut | None
    spread: Spread
    notes: tuple[str, ...] = ()


Steps = Generator[tuple[str, float], None, Estimate]


def estimate(
    table: SampleTable, basis: Basis, capture: Capture, name: str, judge: Judge | None = None
) -> Steps:
    """By the capture's method; yields (what comes next, fraction done). judge: how photos that are
    held out are predicted, None: as the table's samples are. Raises FitError."""
    if judge is None:
        judge = partial(predicted, table)
    if capture.fit.method == "paper":
        return _paper(table, basis, capture, name, judge)
    return _measured(table, basis, capture, name, judge)


def _measured(table: SampleTable, basis: Basis, capture: Capture, name: str, judge: Judge) -> Steps:
    steps = steps_in_background(measured_steps(table, basis))
    while True:
        try:
            yield f"fitting {name}", 0.85 * next(steps)
        except StopIteration as end:
            fit = end.value
            break
    unseen = photos_to_hold_out(table) if capture.fit.held_out else []
    parts = []
    for done, photo in enumerate(unseen):
        at = f"predicting unseen photos of {name}", 0.85 + 0.1 * done / len(unseen)
        yield at
        other = fit.without.pop(photo, None)  # let go: once evaluated each is a megabyte
        if other is not None:
            parts.append((yield from in_background(partial(judge, photo, other), at)))
    yield f"how sure {name} is", 0.95
    kept = MeasuredResult.of(fit)
    return Estimate(kept, summarise(parts), kept.band.spread())


def _paper(table: SampleTable, basis: Basis, capture: Capture, name: str, judge: Judge) -> Steps:
    yield f"fitting {name}", 0.0
    settings = capture.fit.paper
    fit = yield from in_background(
        lambda: fit_paper(table, basis, settings), (f"fitting {name}", 0.0)
    )
    unseen = photos_to_hold_out(table) if capture.fit.held_out else []
    parts = []
    for done, photo in enumerate(unseen):
        yield f"predicting unseen photos of {name}", 0.4 + 0.6 * done / len(unseen)
        parts.append(leave_out(table, photo, basis, settings, judge))
    lost = [capture.photo_name(p) for p, part in zip(unseen, parts, strict=True) if part is None]
    return Estimate(
        fit=fit,
        held_out=summarise([part for part in parts if part is not None]),
        spread=candidate_spread(basis, fit.candidates),
        notes=(f"without {', '.join(lost)} too little is left to fit",) if lost else (),
    )
