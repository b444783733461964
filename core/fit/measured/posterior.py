"""Coefficients from all cells at once: the most probable ones, how sure they are, and what they
would be without any one photo.

Gauss–Newton on the mapped space's residuals. Weights come from each cell's own uncertainty and are
computed anew at every step: pixel noise, the model's floor, and the normals' error times the BRDF's
slope there; a Student t keeps what does not belong (a shadow the mesh does not explain) from
pulling.
"""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from .cell_weights import crowding
from .equations import Arrow, PhotoEquations, add_blocks
from .forward import CellModel, Prediction
from .prior import ChannelPrior

ITERATIONS = 12
DEGREES = 4.0  # of freedom of the Student t
TOGETHER = 30  # neighbouring samples share one error of the normal
READ = 3e-3  # of the mapped level: what photos cannot resolve near black
STEP = 2.0  # most that a coefficient moves at once, in units of its prior
CLOSE = 0.01  # the same, where the search ends
GAIN = 0.03  # prior deviation of a photo's own gain


@dataclass(frozen=True)
class Posterior:
    """coefficients: (3, k). precision: at the optimum, of the coefficients, channels one after the
    other, and of the photos' log gains. gains: {photo: gain}. without: {photo:
    (3, k)} coefficients had the photo not been there."""

    coefficients: NDArray[np.float64]
    precision: Arrow
    gains: dict[int, float]
    without: dict[int, NDArray[np.float64]]

    def covariance(self) -> NDArray[np.float64]:
        """(3, k, k) of each channel's coefficients, the gains integrated out."""
        k = self.coefficients.shape[1]
        full = np.linalg.inv(self.precision.marginal()).reshape(3, k, 3, k)
        return np.stack([full[c, :, c] for c in range(3)])


def solve(
    model: CellModel,
    prior: ChannelPrior,
    floor: float,
    start: NDArray[np.float64] | None = None,
    leave_out: bool = True,
    iterations: int = ITERATIONS,
    together: float = 1.0,
) -> Posterior:
    """floor: log-relative deviation that the model is granted everywhere. together: so many votes
    of a region (cell_weights.py) count as one (power_likelihood.py)."""
    k = len(prior.own)
    crowd = crowding(model.cells)[:, None]
    photos, place = np.unique(model.cells.photo, return_inverse=True)
    p = len(photos)
    prior_precision, prior_pull = prior.precision(), prior.pull()
    state = np.zeros(3 * k + p)
    if start is not None:
        state[: 3 * k] = start.ravel()
    size = np.concatenate([np.tile(np.sqrt(prior.own + prior.shared), 3), np.full(p, GAIN)])
    order = np.argsort(place, kind="stable")
    cells = np.split(order, np.cumsum(np.bincount(place, minlength=p))[:-1])
    for _ in range(iterations):
        prediction = model.predict(state[: 3 * k].reshape(3, k))
        residual, weight = _residuals(model, prediction, state[3 * k :][place], floor)
        weight = weight / (together * crowd)
        each = (_equations(prediction, residual, weight, own) for own in cells)
        total, pull = _summed(each, prior_precision, p)
        pull[: 3 * k] += prior_pull - prior_precision @ state[: 3 * k]
        pull[3 * k :] -= state[3 * k :] / GAIN**2
        step = total.solve(pull)
        far = np.abs(step / size).max()
        state = state + step * min(1.0, STEP / max(far, 1e-12))
        if far < CLOSE:
            break
    without = {}
    if leave_out and p > 1:
        everything = total.marginal()
        for i, (photo, own) in enumerate(zip(photos.tolist(), cells, strict=True)):
            one = _equations(prediction, residual, weight, own)
            shift = _left_out(everything, one, total.coupling[:, i], total.gains[i])
            without[photo] = state[: 3 * k].reshape(3, k) + shift
    return Posterior(
        coefficients=state[: 3 * k].reshape(3, k),
        precision=total,
        gains={
            int(photo): float(np.exp(g)) for photo, g in zip(photos, state[3 * k :], strict=True)
        },
        without=without,
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
        floor**2
        + prediction.spread * np.minimum(1.0, TOGETHER / count)
        + (READ / level) ** 2 / count
        + 0.05**2 / count
    )
    weight = (DEGREES + 1) / (DEGREES + residual**2 / variance) / variance
    return residual, weight


def _equations(
    prediction: Prediction,
    residual: NDArray[np.float64],
    weight: NDArray[np.float64],
    own: NDArray[np.intp],
) -> PhotoEquations:
    """Of the cells ``own`` of one photo."""
    return PhotoEquations.of([s[own] for s in prediction.slopes], residual[own], weight[own])


def _summed(
    each: Iterable[PhotoEquations], prior_precision: NDArray[np.float64], photos: int
) -> tuple[Arrow, NDArray[np.float64]]:
    """(precision of all cells and the prior, right-hand side (3k + p,) of the cells alone)."""
    n = len(prior_precision)
    total = Arrow(prior_precision.copy(), np.zeros((n, photos)), np.full(photos, GAIN**-2))
    pull = np.zeros(n + photos)
    for i, one in enumerate(each):
        add_blocks(total.coefficients, one.blocks)
        total.coupling[:, i] = one.coupling.ravel()
        total.gains[i] += one.gain
        pull[:n] += one.pull.ravel()
        pull[n + i] = one.gain_pull
    return total, pull


def _left_out(
    everything: NDArray[np.float64], one: PhotoEquations, coupling: NDArray[np.float64], gain: float
) -> NDArray[np.float64]:
    """(3, k) step of the coefficients from the optimum of all photos to that without one: without
    its cells its gain says nothing of them. everything: (3k, 3k) precision with its gain integrated
    out; coupling (3k,), gain: that gain's row of the whole precision."""
    rest = everything + np.outer(coupling, coupling) / gain
    add_blocks(rest, one.blocks, -1.0)
    return np.linalg.solve(rest, -one.pull.ravel().astype(np.float64)).reshape(one.pull.shape)
