"""Importance sampling of the rest of a BRDF: a table from which half vectors are drawn, for every
view.

Marginal over θh and conditional over φh, like pbrt's tabulated distributions, constant in each cell
of the grid of hemisphere.py. The density follows the absolute rest of closure_split.py, mean over
the channels; a small part is uniform, which bounds the sample weights.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from ..angles import Angles
from .closure_split import KNOTS, LOBES, ClosureSplit, closures
from .energy import directional_albedo, limit
from .hemisphere import Hemisphere

Array = NDArray[np.floating]

CELLS = (32, 16)  # over θh and φh
WIDTH = max(CELLS[1], KNOTS + LOBES + 1)  # of the picture
INSIDE = 3  # points along each side of a cell
UNIFORM_SHARE = 0.02  # of the probability, uniform over the cells that reflect light


@dataclass(frozen=True)
class SamplingTable:
    """density: (v, n_h, n_p) per sr of half vectors, the same for both halves of φh. marginal: (v,
    n_h) and conditional: (v, n_h, n_p), cumulative probability at the end of each cell. keep: (v,)
    factor that limits the albedo of the BRDF to 1. Views: those of the split."""

    density: Array
    marginal: Array
    conditional: Array
    keep: Array


def sampling_table(evaluate: Callable[[Angles], Array], split: ClosureSplit) -> SamplingTable:
    """The table for the rest that ``split`` leaves of ``evaluate(angles) -> (n, 3)``."""
    n_h, n_p = CELLS
    views = len(split.theta_o)
    density = np.empty((views, n_h, n_p))
    mass = np.empty((views, n_h, n_p))
    for v, theta_o in enumerate(split.theta_o):
        sphere = Hemisphere.of(theta_o, n_h, n_p, INSIDE)
        y = np.asarray(evaluate(sphere.angles), float) * sphere.cos_i[:, None]
        weights = np.concatenate([split.ramp[v], split.lobes[v]])
        rest = np.abs(y - closures(sphere, tuple(split.alpha)) @ weights).mean(axis=1)
        shape = (n_h, INSIDE, n_p, INSIDE)
        inside = (rest * sphere.solid).reshape(shape).sum(axis=(1, 3))
        solid = sphere.half_solid.reshape(shape).sum(axis=(1, 3))
        open_ = (sphere.solid > 0).reshape(shape).any(axis=(1, 3))
        total = float(inside.sum())
        share = inside / total if total > 0 else np.zeros_like(inside)
        spread = solid * open_ / max(float(np.sum(solid * open_)), 1e-12)
        even = UNIFORM_SHARE if total > 0 else 1.0
        mass[v] = (1 - even) * share + even * spread
        density[v] = mass[v] / solid
    rows = mass.sum(axis=2)
    # rounding must not exceed 1: the probability of the last cell would be negative
    marginal = np.minimum(np.cumsum(rows, axis=1), 1.0)
    conditional = np.cumsum(mass, axis=2) / np.maximum(rows, 1e-30)[:, :, None]
    conditional = np.minimum(conditional, 1.0)
    marginal[:, -1], conditional[:, :, -1] = 1.0, 1.0
    keep = limit(directional_albedo(evaluate, split.theta_o))
    return SamplingTable(density, marginal, conditional, keep)


def texels(split: ClosureSplit, table: SamplingTable) -> NDArray[np.float32]:
    """(height, width, 3) picture of both, row 0 at the top: one row per view with its ramp, lobes
    and keep, then one row per view and θh cell: R density, G conditional, B marginal."""
    views, n_h, n_p = table.density.shape
    weights = np.concatenate([split.ramp, split.lobes], axis=1)
    out = np.zeros((views * (1 + n_h), WIDTH, 3), np.float32)
    out[:views, : weights.shape[1]] = weights
    out[:views, weights.shape[1]] = table.keep[:, None]
    block = out[views:, :n_p].reshape(views, n_h, n_p, 3)
    block[..., 0], block[..., 1] = table.density, table.conditional
    block[..., 2] = table.marginal[:, :, None]
    return out
