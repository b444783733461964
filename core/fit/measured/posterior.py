"""Coefficients from all cells at once: the most probable ones, how sure they are, and what they
would be without any one photo.

Gauss–Newton on the mapped space's residuals. Weights come from each cell's own uncertainty and are
computed anew at every step: pixel noise, the model's floor, and the normals' error times the BRDF's
slope there; a Student t keeps what does not belong (a shadow the mesh does not explain) from
pulling.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

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
    """coefficients: (3, k). hessian: (3k + p, 3k + p), the precision at the optimum, channels one
    after the other, then the photos' log gains. gains: {photo: gain}. residual: (m, 3) relative.
    weight: (m, 3). without: {photo: (3, k)} coefficients had the photo not been there."""

    coefficients: NDArray[np.float64]
    hessian: NDArray[np.float64]
    gains: dict[int, float]
    residual: NDArray[np.float64]
    weight: NDArray[np.float64]
    without: dict[int, NDArray[np.float64]]

    def covariance(self) -> NDArray[np.float64]:
        """(3, k, k) of each channel's coefficients, the gains integrated out."""
        k = self.coefficients.shape[1]
        full = np.linalg.inv(self.hessian)[: 3 * k, : 3 * k].reshape(3, k, 3, k)
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
    """floor: log-relative deviation that the model is granted everywhere. together: so many cells
    count as one observation (tempering.py)."""
    k = len(prior.own)
    photos = np.unique(model.cells.photo)
    place = np.searchsorted(photos, model.cells.photo)
    p = len(photos)
    precision = np.zeros((3 * k + p, 3 * k + p))
    precision[: 3 * k, : 3 * k] = prior.precision()
    precision[3 * k :, 3 * k :] = np.eye(p) / GAIN**2
    prior_pull = prior.pull()
    state = np.zeros(3 * k + p)
    if start is not None:
        state[: 3 * k] = start.ravel()
    size = np.concatenate([np.tile(np.sqrt(prior.own + prior.shared), 3), np.full(p, GAIN)])
    for _ in range(iterations):
        prediction = model.predict(state[: 3 * k].reshape(3, k))
        residual, weight = _residuals(model, prediction, state[3 * k :][place], floor)
        weight = weight / together
        hessian, gradient = _normal_equations(prediction, residual, weight, place, p)
        pull = gradient.sum(axis=0) - precision @ state
        pull[: 3 * k] += prior_pull
        step = np.linalg.solve(hessian.sum(axis=0) + precision, pull)
        far = np.abs(step / size).max()
        state = state + step * min(1.0, STEP / max(far, 1e-12))
        if far < CLOSE:
            break
    total = hessian.sum(axis=0) + precision
    without = {}
    if leave_out and p > 1:
        for i, photo in enumerate(photos):
            shift = np.linalg.solve(total - hessian[i], -gradient[i] + 0.0)
            without[int(photo)] = (state + shift)[: 3 * k].reshape(3, k)
    return Posterior(
        coefficients=state[: 3 * k].reshape(3, k),
        hessian=total,
        gains={
            int(photo): float(np.exp(g)) for photo, g in zip(photos, state[3 * k :], strict=True)
        },
        residual=residual,
        weight=weight,
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


def _normal_equations(
    prediction: Prediction,
    residual: NDArray[np.float64],
    weight: NDArray[np.float64],
    place: NDArray[np.intp],
    photos: int,
) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """(hessians (p, 3k + p, 3k + p), gradients (p, 3k + p)) of every photo's cells."""
    k = prediction.slopes[0].shape[1]
    hessian = np.zeros((photos, 3 * k + photos, 3 * k + photos))
    gradient = np.zeros((photos, 3 * k + photos))
    for photo in range(photos):
        own = place == photo
        gain = 3 * k + photo
        for c in range(3):
            part = slice(c * k, (c + 1) * k)
            w = weight[own, c].astype(np.float32)
            rows = prediction.slopes[c][own]
            weighted = rows * w[:, None]
            hessian[photo, part, part] = weighted.T @ rows
            gradient[photo, part] = weighted.T @ residual[own, c].astype(np.float32)
            hessian[photo, part, gain] = weighted.sum(axis=0)
            hessian[photo, gain, part] = weighted.sum(axis=0)
            hessian[photo, gain, gain] += w.sum()
            gradient[photo, gain] += w @ residual[own, c]
    return hessian, gradient
