"""Light that a photo cannot say: channels that are clipped, drawn as the joint fit has them.

A highlight at the scan's own normal is sharper and, at its middle, higher than the photo's, whose
normals are off by what the scan is: an estimator that knows how far scans are off takes that from
what it is given once more. So normals are drawn as far from the scan's as these are off, and of
those under which the photo would be clipped too, one is taken, by how well the channels that are
not clipped agree: an imputation (Rubin 1987).
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from ...angles.vectors import tangents
from ..forward.shading_state import ShadingState
from ..solver.model import Model

Array = NDArray[np.floating]

DRAWS = 24
AGREES = 0.1  # ln, by which predictions of single pixels are off otherwise
UNLIKELY = 1e-6  # of the likeliest, at least: some normal there was
BEYOND, FLAT = 4.0, 0.01  # times as bright, and again: that changes less than this, relative


def plateau_of(model: Model, now: ShadingState, radiance: Array) -> Array:
    """(n, 3) what the photos show at most, infinite where they have no plateau. radiance: that may
    arrive."""
    light = BEYOND * np.maximum(radiance, 1e-12)
    most = model.recorded(light, now)
    more = model.recorded(BEYOND * light, now)
    return np.where(more < (1 + FLAT) * most, most, np.inf)


def impute_clipped(
    model: Model, now: ShadingState, added: Array, plateau: Array, arrived: Array, tilt: float
) -> Array:
    """(n, 3) radiance of the lamp's light on a surface that reflects alike along and across, drawn
    where ``plateau`` (n, 3) is finite, 0 elsewhere.
    added: (n, 3) what else arrives; arrived: (n, 3) all that does, by the photo, where it says it;
    tilt: radians along each tangent, of the scan's normals."""
    out = np.zeros(plateau.shape)
    rows = np.flatnonzero(np.isfinite(plateau).any(axis=1))
    if not len(rows):
        return out
    part = now.select(rows, now.pixels.select(rows))
    at, added, said = plateau[rows], added[rows], arrived[rows]
    clipped = np.isfinite(at)
    told = ~clipped & (said > 0)
    rng = np.random.default_rng(len(rows))
    frame = tangents(part.normal.astype(np.float64))
    taken, plain = np.zeros((len(rows), 3)), np.zeros((len(rows), 3))
    nearest = np.full(len(rows), -np.inf)  # to being clipped, of those that are not
    total = np.zeros(len(rows))
    for _ in range(DRAWS):
        off = tilt * rng.standard_normal((2, len(rows), 1))
        normal = part.normal + off[0] * frame[0] + off[1] * frame[1]
        normal /= np.linalg.norm(normal, axis=1, keepdims=True)
        there = replace(part, normal=normal.astype(np.float32))
        radiance = model.brdfs.reflected(there)
        more = np.log(np.maximum(radiance + added, 1e-12) / np.where(clipped, at, said.clip(1e-12)))
        least = np.where(clipped, more, np.inf).min(axis=1)
        fits = least > 0
        away = np.sum(np.where(told, more / AGREES, 0) ** 2, axis=1)
        likely = fits * np.maximum(np.exp(-away / 2), UNLIKELY)
        total += likely
        chosen = rng.random(len(rows)) * total < likely
        chosen |= ~fits & (total == 0) & (least > nearest)
        nearest = np.where(fits, nearest, np.maximum(nearest, least))
        taken[chosen] = radiance[chosen]
        if part.stretch is not None:
            radiance = model.brdfs.reflected(replace(there, stretch=None))
        plain[chosen] = radiance[chosen]
    least_light = np.where(clipped, np.maximum(at - added, 0), 0)
    out[rows] = np.where(clipped, plain * np.maximum(1, least_light / np.maximum(taken, 1e-12)), 0)
    return out
