"""The result of a diagnosis: effects with their gains, and which of them are named."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from ...photo_names import with_photo_names
from ..solver.model_fit import ModelFit
from .cross_validation import HeldOutPrediction
from .held_out_error import HeldOutErrors
from .residual_structure import MIN_CHANGE, ResidualStructure
from .scan_quality import ScanQuality
from .trial import Trial

Array = NDArray[np.floating]

MIN_GAIN_FRACTION = 0.05
"""Fraction of the gain of the accepted effects. A smaller gain is more likely to compensate a flaw
in their models than to show a further cause."""
CHANGE_PER_DEGREE = 0.05  # RMS change of the photos by errors of the normals finer than a patch
FINE_SCAN = 0.95  # degrees, of the normals: stereo meshes are worse; below, small structure with a
# large gain is unknown too


@dataclass(frozen=True)
class Diagnosis:
    """The causes that were found, and the evidence for them.

    accepted: the effect with the largest gain in the full model first; what the baseline measures
    itself last. rounds: the trials of each round, best first; the last round accepted nothing.
    before, after: the joint fits without and with the named effects. residual: structure that these
    do not explain. error_before, error_after: of held-out regions and photos. expected: (n, 3)
    standard deviation of the baseline. quality: of the scan. contradicted: causes that gain, each
    with a sentence that gives the evidence against it: a material that contradicts it, or a second
    fit that does not confirm it. photo_names: of all photos, for sentences.
    """

    accepted: tuple[Trial, ...]
    rounds: tuple[tuple[Trial, ...], ...]
    before: ModelFit
    after: ModelFit
    held_out_before: HeldOutPrediction
    held_out_after: HeldOutPrediction
    residual: ResidualStructure
    error_before: HeldOutErrors
    error_after: HeldOutErrors
    expected: Array
    quality: ScanQuality
    contradicted: Mapping[str, str] = field(default_factory=dict)
    photo_names: tuple[str, ...] = ()

    @property
    def ranked(self) -> list[Trial]:
        """The accepted effects, then the rest of the first round, best first."""
        first = self.rounds[0] if self.rounds else ()
        accepted = {trial.effect.cause for trial in self.accepted}
        return [*self.accepted, *(t for t in first if t.effect.cause not in accepted)]

    @property
    def named(self) -> tuple[Trial, ...]:
        """The accepted effects without evidence against them."""
        return tuple(t for t in self.accepted if t.effect.cause not in self.contradicted)

    @property
    def reported(self) -> tuple[Trial, ...]:
        """The effects that get a sentence in the report: the accepted ones, and those with evidence
        against them."""
        return tuple(
            t for t in self.ranked if t in self.accepted or t.effect.cause in self.contradicted
        )

    @property
    def causes(self) -> tuple[str, ...]:
        """Names of the named causes, and ``unknown`` if unexplained structure remains."""
        causes = tuple(trial.effect.cause for trial in self.named)
        return (*causes, "unknown") if self.unexplained else causes

    def sentence(self, trial: Trial) -> str:
        """The description of an effect, and the evidence against it."""
        evidence = self.contradicted.get(trial.effect.cause)
        meaning = with_photo_names(trial.sentence(), self.photo_names)
        return (
            meaning
            if evidence is None
            else f"{meaning} However, there is evidence against it. {evidence}"
        )

    @property
    def unexplained_sentence(self) -> str:
        """The description of the structure that remains."""
        return with_photo_names(self.residual.sentence(), self.photo_names)

    @property
    def unexplained(self) -> bool:
        """Whether significant residual structure remains that no cause explains, and that is larger
        than what errors of the scan within a patch leave, and than a flaw in the model of an
        accepted effect would be."""
        gained = sum(trial.gain for trial in self.named)
        normals = 0.0 if self.quality.normals is None else self.quality.normals
        usual = max(MIN_CHANGE, CHANGE_PER_DEGREE * normals) if normals > FINE_SCAN else 0.0
        return (
            self.residual.is_significant
            and self.residual.change > usual
            and self.residual.gain > MIN_GAIN_FRACTION * gained
        )
