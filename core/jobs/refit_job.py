"""Fit the materials again, from samples that are corrected for the causes a diagnosis named."""

from __future__ import annotations

from collections.abc import Collection, Generator, Iterator, Sequence
from dataclasses import replace

import numpy as np

from ..concurrency.background import in_background
from ..concurrency.job import Job, Step, finished
from ..concurrency.steps import relayed
from ..diagnose.correction.highlight_deconvolution import widens_highlights
from ..diagnose.correction.sample_correction import CorrectedSamples, correct_samples
from ..diagnose.correction.sample_pixels import pixels_of_samples
from ..diagnose.effects.base.capabilities import NeedsPhoto, WidensHighlights
from ..diagnose.forward.pixels import Pixels
from ..diagnose.selection.diagnosis import Diagnosis, Trial
from ..diagnose.selection.effect_subset import correctable_effects, with_causes
from ..diagnose.solver.model import Model
from ..diagnose.solver.model_fit import ModelFit
from ..diagnose.solver.scaled_brdfs import with_brdf
from ..errors import PatinaError
from ..fit.held_out import Judge
from ..samples import SampleTable
from .acceptance import Refit, Rejection, evidence_against, joint_log_growth
from .applied_effects import AppliedEffect
from .diagnose_job import DiagnoseJob, normal_deviation
from .fit_job import CaptureResult, MaterialResult, with_portable, with_proposed_photo
from .fit_times import fit_seconds
from .highlight_deconvolution_passes import fit_with_deconvolution

ROUND_SHARE = 0.6  # of the remaining time of a second fit that one round takes
STAGE = "fitting with the named causes"
MIN_SAMPLES = 50  # of a material after correction
CORRECTION_SHARE = 0.3  # fraction of a second fit's time that the correction of samples takes
NOT_DISTINCT = "Its parameters do not differ from 0 (no effect) at the 95 % level."
STILL_BLURRED = (
    "The highlights of this material are as wide as in the photos, because narrower ones do not "
    "predict held-out photos better. A photo under a smaller lamp would show their true width."
)


class RefitJob(Job):
    """Sets ``result``, the fit with the effects taken into account; the first fit if there are
    none.

    ``contradicted``: causes that were dropped, each with the evidence: held-out photos are
    predicted worse with them, or their parameters may be 0. ``unused``: the same, where only the
    second fit is worse. ``fitted``: the joint fit that the second one is based on, None if there is
    none.

    checked: a finished diagnosis. without: causes that it named and that are not corrected.
    exactly: correct for all others even if held-out photos are then predicted worse. portable:
    whether portable forms of the materials are fitted too.
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
        """Fit with all causes. While held-out photos are predicted worse, drop the cause with the
        smallest gain. Then add back each dropped cause that does no harm."""
        before, found = finished(self.checked.result), finished(self.checked.found)
        order = [t for t in correctable_effects(found) if t.effect.cause not in self.without]
        if not self.exactly:
            vague = [trial.effect.cause for trial in order if not trial.is_distinct]
            self.contradicted.update(dict.fromkeys(vague, NOT_DISTINCT))
            order = [trial for trial in order if trial.is_distinct]
        selected, dropped = list(order), list[Trial]()
        again: list[Refit] = []
        begin = 0.0
        judged = before.materials
        if selected and not self.exactly and finished(self.checked.context).variation is not None:
            # samples without the variation are predicted better, with any cause and with none
            plain, _ = yield from self._fits(before, found, (), begin)
            judged = tuple(_proposed(before, plain))
            begin += ROUND_SHARE * (1 - begin)
        while selected:
            again, fitted, rejection = yield from self._with(before, judged, found, selected, begin)
            begin += ROUND_SHARE * (1 - begin)
            if rejection is None:
                self.fitted = fitted
                break
            dropped.append(selected.pop())
            reasons_of = self.contradicted if rejection.of_cause else self.unused
            reasons_of[dropped[-1].effect.cause] = rejection.evidence
        for trial in dropped[-2::-1]:
            more = [t for t in order if t in selected or t is trial]
            other, fitted, rejection = yield from self._with(before, judged, found, more, begin)
            begin += ROUND_SHARE * (1 - begin)
            if rejection is None:
                selected, again, self.fitted = more, other, fitted
                for reasons_of in (self.contradicted, self.unused):
                    reasons_of.pop(trial.effect.cause, None)
        reasons = {**self.contradicted, **self.unused}.items()
        notes = [f"The cause {cause} is not included in the model. {why}" for cause, why in reasons]
        if self.fitted is None:
            materials = [replace(m, warnings=(*m.warnings, *notes)) for m in before.materials]
            yield from self._finish(before, materials, begin)
            return
        materials = [
            replace(m, warnings=(*m.warnings, *a.warnings, *notes))
            for m, a in zip(_proposed(before, again), again, strict=True)
        ]
        taken = selected if any(a.material is not None for a in again) else []
        if all(a.blurred for a in again if a.material is not None):
            taken = [t for t in taken if not isinstance(t.effect, WidensHighlights)]
        used = tuple(_applied(trial, self.fitted.model) for trial in taken)
        yield from self._finish(replace(before, effects=used), materials, begin)

    def _finish(
        self, result: CaptureResult, materials: Sequence[MaterialResult], start: float
    ) -> Iterator[Step]:
        """Set the result. Portable forms are fitted for materials that have none; ``start``:
        fraction of the job that is done."""
        done = list(materials)
        share = (1 - start) / len(done)
        for index, material in enumerate(materials if self.portable else ()):
            at = start + index * share
            done[index] = yield from with_portable(material, at, self.checked.fit.threads)
        found = replace(result, materials=tuple(done))
        self.result = found if not self.portable else (yield from with_proposed_photo(found, 1.0))

    def _with(
        self,
        before: CaptureResult,
        judged: Sequence[MaterialResult],
        found: Diagnosis,
        selected: Sequence[Trial],
        done: float,
    ) -> Generator[Step, None, tuple[list[Refit], ModelFit, Rejection | None]]:
        """(second fits, the joint fit they are based on, the evidence against them). judged: the
        materials without these causes. done: fraction of the job; this takes ROUND_SHARE of the
        rest."""
        again, fitted = yield from self._fits(before, found, selected, done)
        if self.exactly:
            return again, fitted, None
        step = Step(STAGE, done + ROUND_SHARE * (1 - done))
        jointly = yield from in_background(lambda: joint_log_growth(found, fitted), step)
        return again, fitted, evidence_against(judged, again, jointly)

    def _fits(
        self, before: CaptureResult, found: Diagnosis, selected: Sequence[Trial], done: float
    ) -> Generator[Step, None, tuple[list[Refit], ModelFit]]:
        """(second fits, the joint fit they are based on). done: fraction of the job; this takes
        ROUND_SHARE of the rest."""
        step = Step(STAGE, done)
        yield step
        causes = [trial.effect.cause for trial in selected]
        fitted = yield from in_background(lambda: with_causes(found, causes), step)
        again = []
        expected = np.array([fit_seconds(material.used) for material in before.materials])
        shares = ROUND_SHARE * (1 - done) * expected / expected.sum()
        for index, material in enumerate(before.materials):
            share = float(shares[index])
            start = done + float(shares[:index].sum())
            try:
                one = yield from self._refit_material(index, material, fitted.model, start, share)
            except PatinaError as error:
                note = (
                    f"The material could not be fitted with a correction for {', '.join(causes)} "
                    f"({error}). Its first fit is kept."
                )
                one = Refit(None, {}, (note,))
            again.append(one)
        return again, fitted

    def _refit_material(
        self, index: int, material: MaterialResult, model: Model, start: float, share: float
    ) -> Generator[Step, None, Refit]:
        step, fit = Step(STAGE, start), self.checked.fit
        samples = fit.samples[material.name]
        pixels = yield from self._sample_pixels(index, samples, model, step)
        found = yield from self._corrected_samples(samples, pixels, model, step)
        limits = yield from self._corrected_limits(index, fit.limits[material.name], model, step)
        count = np.count_nonzero(found.table.read)
        if count < MIN_SAMPLES:
            raise PatinaError(
                f"samples that can be corrected: {count}; expected at least {MIN_SAMPLES}"
            )
        start, share = start + CORRECTION_SHARE * share, (1 - CORRECTION_SHARE) * share
        wide = widens_highlights(model)
        filled = _clipping_warnings(found.table)
        if not wide and not found.table.read.all():
            # the photos say how bright these are at least; the estimator does the rest
            some = [found.table.select(~found.table.read), *([] if limits is None else [limits])]
            limits = SampleTable.concatenate(some)
            found = replace(found, table=found.table.select(found.table.read))
        elif not found.table.read.all():
            # highlights are wider in the samples than in the BRDF, so their limits are none of it,
            # and the joint fit has no prior for directions in which all samples are clipped, and
            # may invent a highlight there; the estimator has one
            share /= 2
            unclipped = found.table.select(found.table.read)
            known = yield from fit.fit_again(index, unclipped, material, start, share, None)
            model = with_brdf(model, index, known.fit.brdf)
            start += share
            step = Step(STAGE, start)
            found = yield from self._corrected_samples(samples, pixels, model, step)

        def fit_again(
            table: SampleTable, judge: Judge | None, start: float, share: float
        ) -> Generator[Step, None, MaterialResult]:
            again = fit.fit_again(index, table, material, start, share, judge, limits)
            return (yield from again)

        fitted, sharp = yield from fit_with_deconvolution(
            found, fit_again, start, share, self.exactly
        )
        blurred = found.blur is not None and not sharp
        warnings = (*filled, *((STILL_BLURRED,) if blurred else ()))
        return Refit(fitted, found.light, warnings, blurred)

    def _sample_pixels(
        self, index: int, table: SampleTable, model: Model, step: Step
    ) -> Generator[Step, None, Pixels]:
        """The pixels of a material's samples; photos are read where an effect needs them."""
        before = finished(self.checked.result)
        read = any(isinstance(effect, NeedsPhoto) for effect in model.effects)
        steps = pixels_of_samples(table, index, before.capture, before.scan, before.photos, read)
        return (yield from relayed(steps, lambda _: step))

    def _corrected_samples(
        self, table: SampleTable, pixels: Pixels, model: Model, step: Step
    ) -> Generator[Step, None, CorrectedSamples]:
        before, setting = finished(self.checked.result), finished(self.checked.context)
        tilt = float(np.radians(normal_deviation(before)))
        impute = widens_highlights(model)
        correcting = correct_samples(table, pixels, model, setting, tilt, impute=impute)
        return (yield from relayed(correcting, lambda _: step))

    def _corrected_limits(
        self, index: int, clipped: SampleTable, model: Model, step: Step
    ) -> Generator[Step, None, SampleTable | None]:
        """The clipped samples of a material, corrected; None where there are none, or where an
        effect widens highlights: a limit then says nothing about the BRDF of a small lamp."""
        if widens_highlights(model) or not len(clipped):
            return None
        pixels = yield from self._sample_pixels(index, clipped, model, step)
        return (yield from self._corrected_samples(clipped, pixels, model, step)).table


def _clipping_warnings(table: SampleTable) -> tuple[str, ...]:
    """A warning if channels of samples are clipped."""
    filled = np.count_nonzero(~table.read)
    if not filled:
        return ()
    part = 100 * filled / len(table)
    return (
        f"{part:.2g} % of the samples of this material are clipped. Their radiance is estimated "
        "from the other samples and the measured materials. A photo at a quarter of the exposure "
        "would measure it.",
    )


def _proposed(before: CaptureResult, again: Sequence[Refit]) -> list[MaterialResult]:
    """The second fit of each material; its first fit where there is none."""
    both = zip(before.materials, again, strict=True)
    return [one if a.material is None else a.material for one, a in both]


def _applied(trial: Trial, model: Model) -> AppliedEffect:
    """The effect with its parameters in a model."""
    x = trial.effect.identified(model.parameters_of(trial.effect.cause))
    declared = trial.effect.parameters
    return AppliedEffect(
        trial.effect.cause,
        trial.effect.sentence(x, trial.standard_errors),
        declared.names,
        declared.units,
        tuple(x.tolist()),
        tuple(trial.standard_errors.tolist()),
    )
