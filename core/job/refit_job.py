"""Fit the materials again, from samples that are rid of what a diagnosis named."""

from __future__ import annotations

from collections.abc import Collection, Generator, Iterator
from dataclasses import replace

from ..diagnose.chosen import can_be_applied, with_causes
from ..diagnose.corrected import corrected
from ..diagnose.fixed import Fixed
from ..diagnose.model import Model
from ..diagnose.of_samples import pixels_of_samples
from ..diagnose.search import Trial
from ..errors import PatinaError
from ..samples import SampleTable
from .applied import Applied
from .beside import beside
from .diagnose_job import DiagnoseJob
from .fit_job import CaptureResult, MaterialResult
from .job import Job, Step, finished

STAGE = "fitting with what was found"
FEWEST = 50  # samples of a material that are left
CORRECTING = 0.3  # of the time


class RefitJob(Job):
    """``result`` is the fit with the effects in the model; where none is, the fit as it was.

    checked: a finished diagnosis. without: causes that it named and that are left out.
    """

    def __init__(self, checked: DiagnoseJob, without: Collection[str] = ()) -> None:
        super().__init__()
        self.checked = checked
        self.without = without
        self.result: CaptureResult | None = None

    def run(self) -> Iterator[Step]:
        """One material after the other."""
        before, found = finished(self.checked.result), finished(self.checked.found)
        chosen = [t for t in can_be_applied(found) if t.effect.cause not in self.without]
        if not chosen:
            self.result = before
            return
        causes = [trial.effect.cause for trial in chosen]
        step = Step(STAGE, 0.0)
        yield step
        fitted = yield from beside(lambda: with_causes(found, causes), step)
        materials = []
        for index, material in enumerate(before.materials):
            start, share = index / len(before.materials), 1 / len(before.materials)
            try:
                again = yield from self._again(index, material, fitted.model, start, share)
            except PatinaError as error:
                said = f"fitted without {', '.join(causes)}: {error}"
                again = replace(material, warnings=(*material.warnings, said))
            materials.append(again)
        applied = tuple(_applied(trial, fitted.model) for trial in chosen)
        self.result = replace(before, materials=tuple(materials), effects=applied)

    def _again(
        self, index: int, material: MaterialResult, model: Model, start: float, share: float
    ) -> Generator[Step, None, MaterialResult]:
        table = yield from self._corrected(index, material.name, model, Step(STAGE, start))
        if len(table) < FEWEST:
            raise PatinaError(f"too few samples can be corrected: {len(table)}")
        start, share = start + CORRECTING * share, (1 - CORRECTING) * share
        return (yield from self.checked.fit.fitted_again(index, table, material, start, share))

    def _corrected(
        self, index: int, name: str, model: Model, step: Step
    ) -> Generator[Step, None, SampleTable]:
        before, setting = finished(self.checked.result), finished(self.checked.setting)
        table = self.checked.fit.samples[name]
        read = any(effect.of_photo for effect in model.effects)
        steps = pixels_of_samples(table, index, before.capture, before.scan, before.photos, read)
        pixels = yield from _quietly(steps, step)
        return (yield from _quietly(corrected(table, pixels, model, setting), step))


def _applied(trial: Trial, model: Model) -> Applied:
    """With the numbers that it has in a model."""
    effects = [e.inner if isinstance(e, Fixed) else e for e in model.effects]
    place = [e.cause for e in effects].index(trial.effect.cause)
    one = model.effects[place]
    x = trial.effect.told(one.x if isinstance(one, Fixed) else model.x[place])
    numbers = trial.effect.numbers
    return Applied(
        trial.effect.cause,
        trial.effect.sentence(x, trial.deviation),
        numbers.names,
        numbers.units,
        tuple(x.tolist()),
        tuple(trial.deviation.tolist()),
    )


def _quietly(steps, step: Step):  # type: ignore[no-untyped-def]
    """The result of steps, whose fractions are nobody's."""
    while True:
        try:
            next(steps)
        except StopIteration as last:
            return last.value
        yield step
