"""The evidence for one effect: its parameters, its gain on held-out regions, and its size."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray
from scipy.stats import chi2, norm

from ..effects.base.effect import Effect
from ..effects.base.shown_by_background import ShownByBackground
from ..solver.model_fit import ModelFit
from .cross_validation import ParameterErrors, standard_error_of_sum

Array = NDArray[np.floating]
Vector = NDArray[np.float64]

MIN_STANDARD_ERRORS = 2.5  # of the gain over regions, in a joint fit
STRONG_GAIN = (
    0.1  # nats a pixel and channel, which weak evidence for another effect does not outweigh
)
MAX_GROWTH, MAX_GROWTH_IF_STRONG = 1.03, 1.1
"""Of the RMS error of held-out regions. Outliers may hardly be predicted worse; where the gain is
strong, a few pixels in highlights, which dominate the RMS error, do not outweigh all others."""
HALF_WIDTH_95 = 1.96  # standard errors from the centre of a 95 % interval to its ends
MIN_EIGENVALUE = (
    1e-6  # of a correlation matrix: directions below it are not determined by definition
)
MODEL_ERROR_RATIO = 3.0
"""Errors of parameters in units of the standard error that curvature and jackknife give. These do
not know that no measured material is exactly in the basis. Measured on scans with materials of no
basis: 95 % of the errors are below 3 times the half-width of a 95 % interval
(docs/notebook/field-hunt.md)."""
MIN_RELATIVE_CHANGE = 0.005  # RMS change of the photos below which an effect is not reported


@dataclass(frozen=True)
class Trial:
    """effect: with its parameters x (p,), their variances (p,) and correlations (p, p), None where
    these are not known.

    by_region: (b,) nats by which each held-out region is predicted better; values: number of
    values (pixels times channels) in all regions. change: RMS change of the prediction, relative.
    p_value: probability of such a gain by chance, over all effects tried at once. fitted: the joint
    fit with the effect; None where a single step was taken. ties: effects that explain the photos
    as well. contradicted_by: materials that a camera effect predicts worse, though a camera does
    the same to all of them.
    """

    effect: Effect
    x: Vector
    variance: Vector
    by_region: Vector
    values: int
    change: float
    p_value: float
    fitted: ModelFit | None = None
    ties: tuple[Effect, ...] = ()
    contradicted_by: tuple[int, ...] = ()
    growth: float = 1.0
    correlation: Array | None = None

    @property
    def gain(self) -> float:
        """Nats, over all held-out regions."""
        return float(self.by_region.sum())

    @property
    def density(self) -> float:
        """Nats a pixel and channel."""
        return self.gain / max(self.values, 1)

    @property
    def error(self) -> float:
        """Standard error of the gain, over regions."""
        return standard_error_of_sum(self.by_region)

    @property
    def ratio(self) -> float:
        """The gain in standard errors."""
        return self.gain / max(self.error, 1e-9)

    @property
    def is_accepted(self) -> bool:
        """Whether a joint fit confirms the effect: it is more than chance, large enough to be
        reported, and contradicted by no material."""
        return (
            self.ratio > MIN_STANDARD_ERRORS
            and (self.change > MIN_RELATIVE_CHANGE or self.is_shown)
            and self.effect.is_relevant(self.identified)
            and not self.contradicted_by
            and self.growth < (MAX_GROWTH_IF_STRONG if self.is_strong else MAX_GROWTH)
        )

    @property
    def is_shown(self) -> bool:
        """Whether the background of the photos shows the effect too."""
        return isinstance(self.effect, ShownByBackground) and self.effect.is_shown(self.x)

    @property
    def is_strong(self) -> bool:
        """Whether the gain is so large that weak evidence for another effect does not matter."""
        return self.density > STRONG_GAIN

    def sentence(self) -> str:
        """The effect in words, and the photos that would decide between it and its ties."""
        meaning = self.effect.sentence(self.identified, self.standard_errors)
        if not self.ties:
            return meaning
        others = " or ".join(effect.cause for effect in self.ties)
        photos = dict.fromkeys(effect.deciding_photo for effect in (self.effect, *self.ties))
        return (
            f"{meaning} The photos cannot distinguish this from {others}. This would decide: "
            f"{'; or '.join(photos)}."
        )

    def changed(self) -> Array:
        """(n, 3) radiance that the effect adds to the photos, the BRDFs unchanged. Of a trial with
        a joint fit; 0 where the effect is part of the baseline."""
        assert self.fitted is not None
        if self.effect.cause not in self.fitted.model.causes:
            return np.zeros_like(self.fitted.predicted)
        without = self.fitted.model.predicted_without(self.effect.cause)
        return np.asarray(self.fitted.predicted - without)

    @property
    def identified(self) -> Vector:
        """(p,) the part of the parameters that the photos determine."""
        return self.effect.identified(self.x)

    @property
    def standard_errors(self) -> Vector:
        """(p,) of that part."""
        return np.sqrt(np.maximum(self.variance, 0.0))

    @property
    def is_distinct(self) -> bool:
        """Whether the parameters differ from 0, no effect, at the 95 % level: all of them jointly
        (Wald test) or one alone (Bonferroni). They can be uncertain each for itself and certain
        together, such as the ratio of two exposures. Where correlations are not known: whether the
        95 % interval of any parameter does not contain 0. True where no variance is known."""
        x, errors = np.ravel(self.identified), np.ravel(self.standard_errors)
        if not len(x) or len(x) != len(errors):
            return True
        # one alone, among as many as there are; at a limit, a parameter has no variance
        if np.any(np.abs(x) > norm.ppf(1 - 0.025 / len(x)) * errors):
            return True
        if self.correlation is None or self.correlation.shape != (len(x), len(x)):
            return bool(np.any(np.abs(x) > HALF_WIDTH_95 * errors))
        values, vectors = np.linalg.eigh(self.correlation)
        determined = values > MIN_EIGENVALUE
        along = vectors.T @ (x / np.maximum(errors, np.finfo(float).tiny))
        distance = np.sum(along[determined] ** 2 / values[determined])
        return bool(distance > chi2.ppf(0.95, max(int(determined.sum()), 1)))

    def in_fit(self, fitted: ModelFit, variances: tuple[Array, ...]) -> Trial:
        """The trial with its parameters in another joint fit. variances: of the parameters of each
        effect there."""
        place = fitted.model.place_of(self.effect.cause)
        x, variance = fitted.model.x[place], np.asarray(variances[place], np.float64)
        effect = fitted.model.effects[place]
        return replace(self, fitted=fitted, effect=effect, x=x, variance=variance)

    def with_photo_errors(self, by_photo: ParameterErrors | None) -> Trial:
        """The trial with standard errors that include errors common to a whole photo, those of a
        material that is not in the basis, and those of the effect's own approximations. Of a trial
        with a joint fit. by_photo: its parameter_errors_by_photo."""
        assert self.fitted is not None
        place = self.fitted.model.place_of(self.effect.cause)
        if place in self.fitted.model.frozen or not len(self.x):
            return self
        variance, correlation = self.variance, None
        if by_photo is not None:
            variance = np.maximum(by_photo.variances[place], variance)
            correlation = by_photo.correlations[place]
        own = MODEL_ERROR_RATIO**2 * variance
        systematic = np.square(self.effect.systematic_errors(self.identified))
        if correlation is not None and correlation.shape == (len(own), len(own)):
            # systematic errors of different parameters are independent of each other
            size = np.sqrt(own)
            known = self.effect.identifiable
            project = np.eye(len(own)) if known is None else known
            covariance = np.outer(size, size) * correlation
            covariance += project @ np.diag(systematic) @ project.T
            total = np.sqrt(np.maximum(np.diag(covariance), np.finfo(float).tiny))
            correlation = covariance / np.outer(total, total)
        return replace(self, variance=own + systematic, correlation=correlation)
