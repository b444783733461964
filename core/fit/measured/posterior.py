"""Posterior of the coefficients from all cells: its mode, its precision and the coefficients
without each photo.

Gauss–Newton on the residuals in the mapped space. The weights are computed anew at every step from
each cell's uncertainty: the noise model of a pixel (core/noise) divided by the number of samples,
the error of the basis, and the normals' error times the slope of the BRDF. A Student-t error model
limits the influence of outliers, such as shadows that the mesh does not explain. Predictions of
clipped photos are clipped too (forward.py): where the BRDF is brighter than a photo shows, that
photo does not change it.
"""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from ...noise.basis_error import basis_variance
from ...noise.pixel_error import pixel_variance
from ...statistics.student_t import weights_of_squares
from .cell_weights import cells_per_observation
from .equations import Arrow, PhotoEquations, add_blocks
from .forward import CellModel, Prediction
from .prior import CoefficientPrior

ITERATIONS = 12
SAMPLES_PER_NORMAL = 30  # so many neighbouring samples share one error of the normal
MAX_STEP = 2.0  # largest change of a parameter in one iteration, in prior standard deviations
# fraction of a cell's samples: above it, the cell says how large the BRDF is at least, and nothing
# about how much larger it can be
MOSTLY_CLIPPED = 0.5
CONVERGED = 0.01  # the same: the iteration ends where no parameter changes more
GAIN_DEVIATION = 0.03  # prior standard deviation of the logarithm of a photo's gain
# the same of the mean over all samples: the irradiance says how bright all photos together are.
# Otherwise a photo that no BRDF of the basis explains moves the level of all the others.
MEAN_GAIN_DEVIATION = 0.005


@dataclass(frozen=True)
class Posterior:
    """coefficients: (3, k), the mode. precision: at the mode, of the coefficients, channel after
    channel, and of the photos' log gains. gains: photo → gain. without: photo → (3, k) coefficients
    without that photo. measured: the precision without cells that are mostly clipped, None where
    there are none."""

    coefficients: NDArray[np.float64]
    precision: Arrow
    gains: dict[int, float]
    without: dict[int, NDArray[np.float64]]
    measured: Arrow | None

    def covariance(self) -> NDArray[np.float64]:
        """(3, k, k) of each channel's coefficients, the gains integrated out."""
        return self._channels(self.precision)

    def covariance_of_measured(self) -> NDArray[np.float64] | None:
        """The same without cells that are mostly clipped; None where there are none."""
        return None if self.measured is None else self._channels(self.measured)

    def _channels(self, precision: Arrow) -> NDArray[np.float64]:
        k = self.coefficients.shape[1]
        full = np.linalg.inv(precision.marginal()).reshape(3, k, 3, k)
        return np.stack([full[c, :, c] for c in range(3)])


def solve(
    model: CellModel,
    prior: CoefficientPrior,
    floor: float,
    start: NDArray[np.float64] | None = None,
    leave_out: bool = True,
    iterations: int = ITERATIONS,
) -> Posterior:
    """The posterior of a model's coefficients, by Gauss–Newton from ``start`` (3, k), or from 0.

    floor: relative standard deviation of the basis' error far from black. leave_out: compute the
    coefficients without each photo and the precision without clipped cells too. Cells are
    weighted by region (cell_weights.py).
    """
    k = len(prior.mean)
    crowd = cells_per_observation(model.cells)[:, None]
    photos, place = np.unique(model.cells.photo, return_inverse=True)
    p = len(photos)
    prior_precision, prior_pull = prior.full_precision(), prior.rhs()
    state = np.zeros(3 * k + p)
    if start is not None:
        state[: 3 * k] = start.ravel()
    size = np.concatenate([np.tile(np.sqrt(prior.variance), 3), np.full(p, GAIN_DEVIATION)])
    mean = np.bincount(place, model.cells.count) / model.cells.count.sum()
    common = mean / MEAN_GAIN_DEVIATION
    order = np.argsort(place, kind="stable")
    cells = np.split(order, np.cumsum(np.bincount(place, minlength=p))[:-1])
    for _ in range(iterations):
        prediction = model.predict(state[: 3 * k].reshape(3, k))
        residual, weight = _residuals(model, prediction, state[3 * k :][place], floor)
        weight = weight / crowd
        each = (_equations(prediction, residual, weight, own) for own in cells)
        total, rhs = _summed(each, prior_precision, common)
        rhs[: 3 * k] += prior_pull - prior_precision @ state[: 3 * k]
        rhs[3 * k :] -= state[3 * k :] / GAIN_DEVIATION**2 + common * (common @ state[3 * k :])
        step = total.solve(rhs)
        largest_change = np.abs(step / size).max()
        state = state + step * min(1.0, MAX_STEP / max(largest_change, 1e-12))
        if largest_change < CONVERGED:
            break
    measured, limited = None, model.cells.clipped > MOSTLY_CLIPPED
    if leave_out and limited.any():
        known = np.where(limited, 0.0, weight)
        each = (_equations(prediction, residual, known, own) for own in cells)
        measured, _ = _summed(each, prior_precision, common)
    without = {}
    if leave_out and p > 1:
        for i, (photo, own) in enumerate(zip(photos.tolist(), cells, strict=True)):
            one = _equations(prediction, residual, weight, own)
            precision, pull = total.without(i, one, GAIN_DEVIATION**-2)
            shift = np.linalg.solve(precision, pull).reshape(3, k)
            without[photo] = state[: 3 * k].reshape(3, k) + shift
    return Posterior(
        coefficients=state[: 3 * k].reshape(3, k),
        precision=total,
        gains={
            int(photo): float(np.exp(g)) for photo, g in zip(photos, state[3 * k :], strict=True)
        },
        without=without,
        measured=measured,
    )


def _residuals(
    model: CellModel, prediction: Prediction, log_gain: NDArray[np.float64], floor: float
) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """(relative residuals (m, 3), their weights (m, 3))."""
    level = prediction.level * np.exp(log_gain)[:, None]
    # relative, not logarithmic: a cell's mean radiance is unbiased, its logarithm is not
    residual = np.clip(model.observed / level - 1.0, -1.0, 3.0)
    count = model.cells.count[:, None]
    variance = (
        basis_variance(level, floor)
        + prediction.spread * np.minimum(1.0, SAMPLES_PER_NORMAL / count)
        + _of_pixel(model, level) / count
    )
    weight = weights_of_squares(residual**2 / variance) / variance
    return residual, weight


def _of_pixel(model: CellModel, level: NDArray[np.float64]) -> NDArray[np.float64]:
    """(m, 3) relative variance of one sample of each cell."""
    scale = model.scale[:, None]
    noise, bright = model.cells.noise * scale**2, model.cells.bright[:, None] * scale
    return pixel_variance(noise, level, bright) / level**2


def _equations(
    prediction: Prediction,
    residual: NDArray[np.float64],
    weight: NDArray[np.float64],
    own: NDArray[np.intp],
) -> PhotoEquations:
    """Normal equations of the cells ``own`` of one photo."""
    return PhotoEquations.of([s[own] for s in prediction.jacobian], residual[own], weight[own])


def _summed(
    each: Iterable[PhotoEquations],
    prior_precision: NDArray[np.float64],
    common: NDArray[np.float64],
) -> tuple[Arrow, NDArray[np.float64]]:
    """(precision of all cells and the prior, right-hand side (3k + p,) of the cells alone)."""
    n, photos = len(prior_precision), len(common)
    total = Arrow(
        prior_precision.copy(),
        np.zeros((n, photos)),
        np.full(photos, GAIN_DEVIATION**-2),
        common,
    )
    rhs = np.zeros(n + photos)
    for i, one in enumerate(each):
        add_blocks(total.coefficients, one.blocks)
        total.coupling[:, i] = one.coupling.ravel()
        total.gains[i] += one.gain
        rhs[:n] += one.rhs.ravel()
        rhs[n + i] = one.gain_rhs
    return total, rhs
