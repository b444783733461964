"""Fit the materials again, from samples that are rid of what a diagnosis named."""

from __future__ import annotations

from collections.abc import Collection, Generator, Iterator, Sequence
from dataclasses import dataclass, replace

import numpy as np

from ..diagnose.chosen import can_be_applied, with_causes
from ..diagnose.corrected import corrected
from ..diagnose.model import Model
from ..diagnose.of_samples import pixels_of_samples
from ..diagnose.search import Found, Trial
from ..errors import PatinaError
from ..samples import SampleTable
from ..steps import relayed
from .applied import Applied
from .beside import beside
from .diagnose_job import DiagnoseJob
from .fit_job import CaptureResult, MaterialResult, with_portable
from .job import Job, Step, finished

STAGE = "fitting with what was found"
FEWEST = 50  # samples of a material that are left
CORRECTING = 0.3  # of the time
MORE = 0.03  # ln of what errors of unseen photos may grow by


@dataclass(frozen=True)
class Again:
    """A material's second fit. material: None where it could not be fitted; light: RMS radiance of
    its samples, as photos show it, over that of all they show; warnings: what is to be said."""

    material: MaterialResult | None
    light: float
    warnings: tuple[str, ...]


class RefitJob(Job):
    """``result`` is the fit with the effects in the model; where none is, the fit as it was.

    checked: a finished diagnosis. without: causes that it named and that are left out. exactly: the
    rest is taken into account even where unseen photos are then predicted worse. portable: whether
    the materials' portable forms are fitted too.
    """

    def __init__(
        self,
        checked: DiagnoseJob,
        without: Collection[str] = (),
        exactly: bool = False,
        portable: bool = True,
    ) -> None:
        super().__init__()
        self.checked = checked
        self.without = without
        self.exactly = exactly
        self.portable = portable
        self.result: CaptureResult | None = None

    def run(self) -> Iterator[Step]:
        """With all causes; where unseen photos are then predicted worse, without the one of them
        that gained least."""
        before, found = finished(self.checked.result), finished(self.checked.found)
        chosen = [t for t in can_be_applied(found) if t.effect.cause not in self.without]
        dropped: list[str] = []
        attempt = 0.5
        while chosen:
            again, applied = yield from self._with(before, found, chosen, 1 - 2 * attempt)
            worse = None if self.exactly else _worse(before.materials, again)
            if worse is None:
                materials = [
                    replace(m, warnings=(*m.warnings, *a.warnings, *dropped))
                    for m, a in zip(_proposed(before, again), again, strict=True)
                ]
                used = applied if any(a.material is not None for a in again) else ()
                yield from self._finish(replace(before, effects=used), materials, 1 - attempt)
                return
            dropped.append(f"{chosen.pop().effect.cause} is not taken into account: {worse}")
            attempt /= 2
        materials = [replace(m, warnings=(*m.warnings, *dropped)) for m in before.materials]
        yield from self._finish(before, materials, 1 - 2 * attempt)

    def _finish(
        self, result: CaptureResult, materials: Sequence[MaterialResult], start: float
    ) -> Iterator[Step]:
        """With the portable forms of those materials that have none, from ``start`` of the job."""
        done = list(materials)
        share = (1 - start) / len(done)
        for index, material in enumerate(materials if self.portable else ()):
            at = start + index * share
            done[index] = yield from with_portable(material, at, self.checked.fit.threads)
        self.result = replace(result, materials=tuple(done))

    def _with(
        self, before: CaptureResult, found: Found, chosen: Sequence[Trial], done: float
    ) -> Generator[Step, None, tuple[list[Again], tuple[Applied, ...]]]:
        """One material after the other; done: of the job, of which this takes half the rest."""
        causes = [trial.effect.cause for trial in chosen]
        step = Step(STAGE, done)
        yield step
        fitted = yield from beside(lambda: with_causes(found, causes), step)
        applied = tuple(_applied(trial, fitted.model) for trial in chosen)
        out = []
        share = 0.5 * (1 - done) / len(before.materials)
        for index, material in enumerate(before.materials):
            start = done + index * share
            try:
                out.append((yield from self._again(index, material, fitted.model, start, share)))
            except PatinaError as error:
                said = f"fitted without {', '.join(causes)}: {error}"
                out.append(Again(None, 1.0, (said,)))
        return out, applied

    def _again(
        self, index: int, material: MaterialResult, model: Model, start: float, share: float
    ) -> Generator[Step, None, Again]:
        table, light = yield from self._corrected(index, material.name, model, Step(STAGE, start))
        count = np.count_nonzero(table.read)
        if count < FEWEST:
            raise PatinaError(f"too few samples can be corrected: {count}")
        start, share = start + CORRECTING * share, (1 - CORRECTING) * share
        fitted = yield from self.checked.fit.fitted_again(index, table, material, start, share)
        return Again(fitted, light, _of_clipped(table))

    def _corrected(
        self, index: int, name: str, model: Model, step: Step
    ) -> Generator[Step, None, tuple[SampleTable, float]]:
        before, setting = finished(self.checked.result), finished(self.checked.setting)
        table = self.checked.fit.samples[name]
        read = any(effect.of_photo for effect in model.effects)
        steps = pixels_of_samples(table, index, before.capture, before.scan, before.photos, read)
        pixels = yield from relayed(steps, lambda _: step)
        return (yield from relayed(corrected(table, pixels, model, setting), lambda _: step))


def _of_clipped(table: SampleTable) -> tuple[str, ...]:
    """In words, where channels of samples are predictions."""
    filled = np.count_nonzero(~table.read)
    if not filled:
        return ()
    part = 100 * filled / len(table)
    return (
        f"{part:.2g} % of its samples are clipped: how bright they are is what the rest of the "
        "photos and measured materials say; a photo at a quarter of the exposure would tell",
    )


def _proposed(before: CaptureResult, again: Sequence[Again]) -> list[MaterialResult]:
    """The second fit's where there is one."""
    both = zip(before.materials, again, strict=True)
    return [one if a.material is None else a.material for one, a in both]


def _worse(before: Sequence[MaterialResult], after: Sequence[Again]) -> str | None:
    """In words, where unseen photos are predicted worse than without: a model may explain what it
    was fitted to by something that is not there. Both errors are relative to all that photos show:
    in light that a steep curve was taken from, the same error is another part."""
    known = [
        (one.held_out.error, other.material.held_out.error * other.light)
        for one, other in zip(before, after, strict=True)
        if other.material is not None
        and one.held_out is not None
        and other.material.held_out is not None
    ]
    if not known:
        return None
    grown = np.mean([np.log(max(b, 1e-9) / max(a, 1e-9)) for a, b in known])
    if grown < MORE:
        return None
    said = ", ".join(f"{100 * a:.1f} to {100 * b:.1f} %" for a, b in known)
    return f"with it, RMS errors of unseen photos grow from {said}"


def _applied(trial: Trial, model: Model) -> Applied:
    """With the numbers that it has in a model."""
    x = trial.effect.told(model.numbers_of(trial.effect.cause))
    numbers = trial.effect.numbers
    return Applied(
        trial.effect.cause,
        trial.effect.sentence(x, trial.deviation),
        numbers.names,
        numbers.units,
        tuple(x.tolist()),
        tuple(trial.deviation.tolist()),
    )
