"""The scale of each texel from its samples, by robust weighted least squares.

The model of a sample is a = s + g·q + e: a is the observed factor of the diffuse body, s the scale
of the texel, g the change of ln α, q the derivative of a by ln α, and e an error of known standard
deviation. Student-t errors reduce the weight of samples that disagree with the others of the same
texel: a shadow that the mesh does not cast, a misplaced highlight.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from ..statistics.student_t import weights_of_squares
from .slots import TexelSlots

Array = NDArray[np.floating]

ROUNDS = 4  # of iteratively reweighted least squares
MAX_ERROR = 3.0  # standard error of a sample's scale: samples with larger ones are not used
MIN_GLOSS, MAX_GLOSS = np.log(0.5), np.log(2.0)  # bounds of the change of ln α
GLOSS_PRIOR = 0.35  # standard deviation of ln α over a surface
MAX_GLOSS_ERROR = 0.25  # standard error of ln α: with a larger one, the gloss counts as unknown


@dataclass(frozen=True)
class TexelScales:
    """Results for n texels. scale: (n, 3), factor of the diffuse body, NaN without usable samples.
    weight: (n,) inverse variance of the scale, 0 there. photos: (n,) effective number of samples.
    spread: (n,) RMS residual of the samples in units of their errors (1 with fewer than two).
    gloss: (n,) ln of the factor of α, 0 where it is unknown; gloss_error: (n,) its standard error,
    infinite there."""

    scale: NDArray[np.float32]
    weight: NDArray[np.float32]
    photos: NDArray[np.float32]
    spread: NDArray[np.float32]
    gloss: NDArray[np.float32]
    gloss_error: NDArray[np.float32]


def solve_texels(
    slots: TexelSlots,
    material: NDArray[np.uint8],
    part: slice,
    channels: NDArray[np.floating] | None = None,
) -> TexelScales:
    """Solve the texels ``part`` of a band, each from its samples of its own ``material`` (n,).

    channels: (materials, 3) weights of the channels in the grey value that weights and gloss are
    computed from, rows sum to 1; None: equal weights.
    """
    scale = slots.scale[:, part].astype(np.float32)
    error = slots.error[:, part].astype(np.float32)
    q = slots.gloss[:, part].astype(np.float32)
    good = (
        np.isfinite(error) & (error < MAX_ERROR) & (slots.material[:, part] == material[None, part])
    )
    own = np.where(good, 1.0 / np.maximum(error, 1e-3) ** 2, 0.0).astype(np.float32)
    if channels is None:
        grey = scale.mean(axis=2)
    else:
        share = channels.astype(np.float32)[material[part]]
        grey = np.einsum("snc,nc->sn", scale, share)
    centre = weighted_median(grey, own)
    gloss = np.zeros(grey.shape[1], np.float32)
    weight = own
    for _ in range(ROUNDS):
        away = (grey - gloss * q - centre) ** 2 * own
        weight = own * weights_of_squares(away).astype(np.float32)
        total = np.maximum(weight.sum(axis=0), 1e-30)
        mean_q = (weight * q).sum(axis=0) / total
        mean = (weight * grey).sum(axis=0) / total
        # the gloss is fitted to differences between samples of one texel: its scale is free
        information = (weight * (q - mean_q) ** 2).sum(axis=0)
        pull = (weight * (q - mean_q) * (grey - mean)).sum(axis=0)
        gloss = np.clip(pull / (information + GLOSS_PRIOR**-2), MIN_GLOSS, MAX_GLOSS)
        centre = mean - gloss * mean_q
    total = weight.sum(axis=0)
    seen = total > 0
    away = (grey - gloss * q - centre) ** 2 * weight
    agree = (weight / np.maximum(own, 1e-30)).sum(axis=0)
    several = good.sum(axis=0) > 1
    free = np.maximum(good.sum(axis=0) - 1, 1)
    spread = np.where(several, np.sqrt(away.sum(axis=0) / free), 1.0)
    found = np.einsum("sn,snc->nc", weight, scale - (gloss * q)[..., None])
    with np.errstate(invalid="ignore", divide="ignore"):
        found = np.where(seen[:, None], found / total[:, None], np.nan)
        gloss_error = np.where(information > 0, 1 / np.sqrt(information), np.inf)
    known = seen & (gloss_error < MAX_GLOSS_ERROR)
    return TexelScales(
        scale=np.maximum(found, 0.0).astype(np.float32),
        weight=(total / np.maximum(spread, 1.0) ** 2).astype(np.float32),
        photos=agree.astype(np.float32),
        spread=spread.astype(np.float32),
        gloss=np.where(known, gloss, 0.0).astype(np.float32),
        gloss_error=np.where(known, gloss_error, np.inf).astype(np.float32),
    )


def weighted_median(values: Array, weight: Array) -> Array:
    """(n,) lower weighted median over the first axis of values (s, n); 0 if all weights are 0."""
    order = np.argsort(values, axis=0)
    ordered = np.take_along_axis(values, order, axis=0)
    below = np.cumsum(np.take_along_axis(weight, order, axis=0), axis=0)
    half = 0.5 * below[-1]
    pick = np.minimum((below < half).sum(axis=0), len(values) - 1)
    found = np.take_along_axis(ordered, pick[None], axis=0)[0]
    return np.where(below[-1] > 0, found, 0.0)
