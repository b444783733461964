"""Fit the materials again, from samples that are rid of what a diagnosis named."""

from __future__ import annotations

from collections.abc import Collection, Generator, Iterator, Sequence
from dataclasses import replace

import numpy as np

from ..concurrency.background import in_background
from ..concurrency.job import Job, Step, finished
from ..concurrency.steps import relayed
from ..diagnose.correction.sample_correction import CorrectedSamples, correct_samples
from ..diagnose.correction.sample_pixels import pixels_of_samples
from ..diagnose.effects.base.capabilities import NeedsPhoto, WidensHighlights
from ..diagnose.selection.diagnosis import Diagnosis, Trial
from ..diagnose.selection.effect_subset import correctable_effects, with_causes
from ..diagnose.solver.model import Model
from ..diagnose.solver.model_fit import ModelFit
from ..errors import PatinaError
from ..fit.held_out import Judge
from ..samples import SampleTable
from .acceptance import Refit, Rejection, seen_jointly, worse
from .applied_effects import AppliedEffect
from .diagnose_job import DiagnoseJob, normal_deviation
from .fit_job import CaptureResult, MaterialResult, with_portable
from .highlight_deconvolution_passes import fitted_sharply

STAGE = "fitting with what was found"
FEWEST = 50  # samples of a material that are left
CORRECTING = 0.3  # of the time
AS_WIDE = (
    "its highlights are as wide as the photos show them: made sharper, they predict unseen photos "
    "no better; a photo under a smaller lamp would tell"
)


class RefitJob(Job):
    """``result`` is the fit with the effects in the model; where none is, the fit as it was.
    ``doubted`` are causes that were left out for what they do to unseen photos, and what that is;
    ``unused`` are those of which only the second fit makes nothing. ``fitted`` is the joint fit
    that the second one rests on, None where it rests on none.

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
        self.contradicted: dict[str, str] = {}
        self.unused: dict[str, str] = {}
        self.fitted: ModelFit | None = None

    def run(self) -> Iterator[Step]:
        """With all causes; where unseen photos are then predicted worse, without the one of them
        that gained least, and so on. What was left out in vain before that helped is put back."""
        before, found = finished(self.checked.result), finished(self.checked.found)
        order = [t for t in correctable_effects(found) if t.effect.cause not in self.without]
        chosen, left_out = list(order), list[Trial]()
        again: list[Refit] = []
        begin = 0.0
        while chosen:
            again, fitted, refusal = yield from self._with(before, found, chosen, begin)
            begin += 0.5 * (1 - begin)
            if refusal is None:
                self.fitted = fitted
                break
            left_out.append(chosen.pop())
            told = self.contradicted if refusal.of_cause else self.unused
            told[left_out[-1].effect.cause] = refusal.words
        for trial in left_out[-2::-1]:
            more = [t for t in order if t in chosen or t is trial]
            other, fitted, refusal = yield from self._with(before, found, more, begin)
            begin += 0.5 * (1 - begin)
            if refusal is None:
                chosen, again, self.fitted = more, other, fitted
                for told in (self.contradicted, self.unused):
                    told.pop(trial.effect.cause, None)
        reasons = {**self.contradicted, **self.unused}.items()
        said = [f"{cause} is not taken into account: {why}" for cause, why in reasons]
        if self.fitted is None:
            materials = [replace(m, warnings=(*m.warnings, *said)) for m in before.materials]
            yield from self._finish(before, materials, begin)
            return
        materials = [
            replace(m, warnings=(*m.warnings, *a.warnings, *said))
            for m, a in zip(_proposed(before, again), again, strict=True)
        ]
        taken = chosen if any(a.material is not None for a in again) else []
        if all(a.blurred for a in again if a.material is not None):
            taken = [t for t in taken if not isinstance(t.effect, WidensHighlights)]
        used = tuple(_applied(trial, self.fitted.model) for trial in taken)
        yield from self._finish(replace(before, effects=used), materials, begin)

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
        self, before: CaptureResult, found: Diagnosis, chosen: Sequence[Trial], done: float
    ) -> Generator[Step, None, tuple[list[Refit], ModelFit, Rejection | None]]:
        """Second fits, the joint fit they are of, and why they are refused; done: of the job, of
        which this takes half the rest."""
        step = Step(STAGE, done)
        yield step
        causes = [trial.effect.cause for trial in chosen]
        fitted = yield from in_background(lambda: with_causes(found, causes), step)
        again = []
        share = 0.5 * (1 - done) / len(before.materials)
        for index, material in enumerate(before.materials):
            start = done + index * share
            try:
                one = yield from self._again(index, material, fitted.model, start, share)
            except PatinaError as error:
                said = f"fitted without {', '.join(causes)}: {error}"
                one = Refit(None, {}, (said,))
            again.append(one)
        if self.exactly:
            return again, fitted, None
        jointly = yield from in_background(lambda: seen_jointly(found, fitted), step)
        return again, fitted, worse(before.materials, again, jointly)

    def _again(
        self, index: int, material: MaterialResult, model: Model, start: float, share: float
    ) -> Generator[Step, None, Refit]:
        found = yield from self._corrected(index, material.name, model, Step(STAGE, start))
        count = np.count_nonzero(found.table.read)
        if count < FEWEST:
            raise PatinaError(f"too few samples can be corrected: {count}")
        start, share = start + CORRECTING * share, (1 - CORRECTING) * share

        def fitted_again(
            table: SampleTable, judge: Judge | None, start: float, share: float
        ) -> Generator[Step, None, MaterialResult]:
            fit = self.checked.fit
            return (yield from fit.fitted_again(index, table, material, start, share, judge))

        fitted, sharp = yield from fitted_sharply(found, fitted_again, start, share, self.exactly)
        blurred = found.blur is not None and not sharp
        warnings = (*_of_clipped(found.table), *((AS_WIDE,) if blurred else ()))
        return Refit(fitted, found.light, warnings, blurred)

    def _corrected(
        self, index: int, name: str, model: Model, step: Step
    ) -> Generator[Step, None, CorrectedSamples]:
        before, setting = finished(self.checked.result), finished(self.checked.context)
        table = self.checked.fit.samples[name]
        read = any(isinstance(effect, NeedsPhoto) for effect in model.effects)
        steps = pixels_of_samples(table, index, before.capture, before.scan, before.photos, read)
        pixels = yield from relayed(steps, lambda _: step)
        tilt = float(np.radians(normal_deviation(before)))
        correcting = correct_samples(table, pixels, model, setting, tilt)
        return (yield from relayed(correcting, lambda _: step))


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


def _proposed(before: CaptureResult, again: Sequence[Refit]) -> list[MaterialResult]:
    """The second fit's where there is one."""
    both = zip(before.materials, again, strict=True)
    return [one if a.material is None else a.material for one, a in both]


def _applied(trial: Trial, model: Model) -> AppliedEffect:
    """With the numbers that it has in a model."""
    x = trial.effect.identified(model.parameters_of(trial.effect.cause))
    numbers = trial.effect.parameters
    return AppliedEffect(
        trial.effect.cause,
        trial.effect.sentence(x, trial.standard_errors),
        numbers.names,
        numbers.units,
        tuple(x.tolist()),
        tuple(trial.standard_errors.tolist()),
    )
