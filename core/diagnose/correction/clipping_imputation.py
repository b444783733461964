"""Imputation of the radiance of clipped channels from the BRDF of the other samples.

A highlight that is predicted at the scan's normals is sharper and higher at its centre than in the
photo, because the true normals differ from the scan's. The estimator of the second fit expects such
errors of the normals and would correct for them again. So normals are drawn with the error of the
scan's normals. Of those under which the photo would be clipped as well, one is selected with
probabilities that depend on how well the unclipped channels agree: an imputation (Rubin 1987).
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from ...angles.vectors import tangents
from ..forward.shading_state import ShadingState
from ..solver.model import Model

Array = NDArray[np.floating]

DRAWS = 24  # of normals
LOG_ERROR = 0.1  # ln, standard deviation of the prediction of a single pixel
MIN_LIKELIHOOD = 1e-6  # relative to the largest possible, so that one draw is always selected
BEYOND, FLAT = 4.0, 0.01  # factor in radiance that, at a plateau, changes less than this, relative


def plateau_of(model: Model, now: ShadingState, radiance: Array) -> Array:
    """(n, 3) largest recorded value, infinite where there is no plateau. radiance: (n, 3) that may
    arrive."""
    light = BEYOND * np.maximum(radiance, 1e-12)
    most = model.recorded(light, now)
    more = model.recorded(BEYOND * light, now)
    return np.where(more < (1 + FLAT) * most, most, np.inf)


def impute_clipped(
    model: Model, now: ShadingState, added: Array, plateau: Array, arrived: Array, tilt: float
) -> Array:
    """(n, 3) reflected radiance of the lamp on an isotropic surface, drawn where ``plateau`` (n, 3)
    is finite, 0 elsewhere. added: (n, 3) other radiance that arrives. arrived: (n, 3) all radiance
    that arrives, from the photo, valid where it is not clipped. tilt: radians along each tangent,
    standard deviation of the scan's normals."""
    out = np.zeros(plateau.shape)
    rows = np.flatnonzero(np.isfinite(plateau).any(axis=1))
    if not len(rows):
        return out
    part = now.select(rows, now.pixels.select(rows))
    at, added, measured = plateau[rows], added[rows], arrived[rows]
    clipped = np.isfinite(at)
    unclipped = ~clipped & (measured > 0)
    rng = np.random.default_rng(len(rows))
    frame = tangents(part.normal.astype(np.float64))
    taken, plain = np.zeros((len(rows), 3)), np.zeros((len(rows), 3))
    nearest = np.full(len(rows), -np.inf)  # of the draws that are not clipped
    total = np.zeros(len(rows))
    for _ in range(DRAWS):
        off = tilt * rng.standard_normal((2, len(rows), 1))
        normal = part.normal + off[0] * frame[0] + off[1] * frame[1]
        normal /= np.linalg.norm(normal, axis=1, keepdims=True)
        there = replace(part, normal=normal.astype(np.float32))
        radiance = model.brdfs.reflected(there)
        more = np.log(
            np.maximum(radiance + added, 1e-12) / np.where(clipped, at, measured.clip(1e-12))
        )
        least = np.where(clipped, more, np.inf).min(axis=1)
        fits = least > 0
        away = np.sum(np.where(unclipped, more / LOG_ERROR, 0) ** 2, axis=1)
        likely = fits * np.maximum(np.exp(-away / 2), MIN_LIKELIHOOD)
        total += likely
        selected = rng.random(len(rows)) * total < likely
        selected |= ~fits & (total == 0) & (least > nearest)
        nearest = np.where(fits, nearest, np.maximum(nearest, least))
        taken[selected] = radiance[selected]
        if part.stretch is not None:
            radiance = model.brdfs.reflected(replace(there, stretch=None))
        plain[selected] = radiance[selected]
    least_light = np.where(clipped, np.maximum(at - added, 0), 0)
    out[rows] = np.where(clipped, plain * np.maximum(1, least_light / np.maximum(taken, 1e-12)), 0)
    return out
