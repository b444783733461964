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
from ..errors import InputError
from ..samples import SampleTable
from .applied import Applied
from .beside import beside
from .diagnose_job import DiagnoseJob
from .fit_job import CaptureResult
from .job import Job, Step, finished

FEWEST = 50  # samples of a material that are left


class RefitJob(Job):
    """``result`` is the fit with the effects in the model; where none is, the fit as it was.

    checked: a finished diagnosis. causes: of what it named, all where None. Raises InputError for
    one that it did not name.
    """

    def __init__(self, checked: DiagnoseJob, causes: Collection[str] | None = None) -> None:
        super().__init__()
        self.checked = checked
        found = finished(checked.found)
        named = [trial.effect.cause for trial in can_be_applied(found)]
        unknown = sorted(set(causes or ()) - {t.effect.cause for t in found.accepted})
        if unknown:
            raise InputError(f"{unknown[0]!r} was not named: expected of {', '.join(named)}")
        self.causes = named if causes is None else [cause for cause in named if cause in causes]
        self.result: CaptureResult | None = None

    def run(self) -> Iterator[Step]:
        """One material after the other."""
        before = finished(self.checked.result)
        if not self.causes:
            self.result = before
            return
        stage = "fitting with what was found"
        found = finished(self.checked.found)
        step = Step(stage, 0.0)
        yield step
        fitted = yield from beside(lambda: with_causes(found, self.causes), step)
        materials = []
        share = 1 / len(before.materials)
        for index in range(len(before.materials)):
            start = index * share
            table = yield from self._corrected(index, fitted.model, Step(stage, start))
            if len(table) < FEWEST:
                name = before.materials[index].name
                raise InputError(f"{len(table)} samples of {name!r} are left, expected {FEWEST}")
            again = self.checked.fit.fitted_again(
                index, table, before.materials[index], start + 0.3 * share, 0.7 * share
            )
            materials.append((yield from again))
        applied = tuple(
            _applied(trial, fitted.model)
            for trial in can_be_applied(found)
            if trial.effect.cause in self.causes
        )
        self.result = replace(before, materials=tuple(materials), effects=applied)

    def _corrected(
        self, index: int, model: Model, step: Step
    ) -> Generator[Step, None, SampleTable]:
        before, setting = finished(self.checked.result), finished(self.checked.setting)
        table = self.checked.fit.samples[before.materials[index].name]
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
    said = trial.effect.sentence(x, trial.deviation)
    return Applied(
        trial.effect.cause, said, numbers.names, numbers.units, tuple(x.tolist()),
        tuple(trial.deviation.tolist()),
    )  # fmt: skip


def _quietly(steps, step: Step):  # type: ignore[no-untyped-def]
    """The result of steps, whose fractions are nobody's."""
    while True:
        try:
            next(steps)
        except StopIteration as last:
            return last.value
        yield step
