"""Normals corrected by what the photos show, given the BRDF (what the paper leaves as future work).

Each patch of the surface gets one small rotation, found from all photos that see it lit; it costs
what a scan's normals may be off by, and to differ from its neighbours. Where the BRDF is flat the
photos say nothing about normals, and the scan's stay.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray
from scipy.sparse.linalg import LinearOperator, cg

from ...angles import half_difference
from ...angles.vectors import dot, tangents
from ...basis import mapping
from ...basis.log_table import LogTable
from ...samples import SampleTable
from .patches import Patches

Array = NDArray[np.float64]

ROUNDS = 3  # the model is linearised at each
NUDGE = 2e-3  # radians, for slopes
DARK = 2e-3  # of the reflected light: below, photos show noise
TOLERANCE = 0.05  # log-relative, of a BRDF that is like measured ones
SMOOTH = 0.3  # a patch's difference to a neighbour costs so much of its own size
DEGREES = 4.0  # of freedom of the Student t
LARGEST = np.radians(12.0)
SURE = np.radians(0.01)  # no scan is nearer to the surface


@dataclass(frozen=True)
class RefinedNormals:
    """table: the samples as their corrected normals see them. error: (n,) radians, deviation along
    each tangent that is left. deviation: radians, the scan's own, as these corrections say."""

    table: SampleTable
    error: NDArray[np.float64]
    deviation: float


def refine_normals(
    scanned: SampleTable,
    patches: Patches,
    brdf: LogTable,
    deviation: float,
    tolerance: float = TOLERANCE,
) -> RefinedNormals:
    """scanned: samples with the scan's normals; brdf: its LogTable; deviation: radians along each
    tangent that the scan's normals are expected to be off by; tolerance: log-relative, what the
    BRDF itself may be off by."""
    grey = brdf.grey()
    normal = scanned.normal.astype(np.float64)
    seen = (scanned.radiance / scanned.irradiance).mean(axis=1, dtype=np.float64)
    observed = np.log(np.maximum(seen, 0.0) + DARK)
    turn = np.zeros((patches.count, 3))
    for _ in range(ROUNDS):
        turned = _unit(normal + turn[patches.of])
        slope, misfit = _linearised(grey, turned, scanned, observed)
        weight = (DEGREES + 1) / (DEGREES + (misfit / tolerance) ** 2) / tolerance**2
        # samples of one patch and photo share the model's error: they count once, not each
        weight = weight / _crowd(scanned.photo, patches)
        turn, left, again = _solve(patches, slope, misfit, weight, turn, deviation)
        size = np.linalg.norm(turn, axis=1, keepdims=True)
        turn = turn * np.minimum(1.0, LARGEST / np.maximum(size, 1e-12))
    turned = _unit(normal + turn[patches.of])
    return RefinedNormals(seen_with(scanned, turned), left[patches.of], again)


def seen_with(table: SampleTable, normal: Array) -> SampleTable:
    """The same samples under other normals (n, 3)."""
    n = normal.astype(np.float32)
    angles = half_difference(n, table.light, table.view)
    cos_i = np.maximum(dot(n, table.light), np.float32(1e-3))
    return replace(
        table,
        theta_h=angles.theta_h,
        theta_d=angles.theta_d,
        phi_d=angles.phi_d,
        cos_i=cos_i,
        cos_o=dot(n, table.view),
        rho=table.radiance / (table.irradiance * cos_i[:, None]),
        normal=n,
    )


def _linearised(
    grey: LogTable, normal: Array, table: SampleTable, observed: Array
) -> tuple[Array, Array]:
    """(∂ ln L/∂n (n, 3) in the tangent plane, misfit (n,) of ln L)."""
    first, second = tangents(normal)
    base = _log_reflected(grey, normal, table)
    one = (_log_reflected(grey, _unit(normal + NUDGE * first), table) - base) / NUDGE
    two = (_log_reflected(grey, _unit(normal + NUDGE * second), table) - base) / NUDGE
    return one[:, None] * first + two[:, None] * second, observed - base


def _log_reflected(grey: LogTable, normal: Array, table: SampleTable) -> Array:
    n = normal.astype(np.float32)
    angles = half_difference(n, table.light, table.view)
    cos_i = np.maximum(dot(n, table.light), np.float32(0.02))
    level = np.exp(grey.logs(angles)[:, 0]) - np.float32(mapping.EPSILON)
    rho = np.maximum(level, 0.0) / mapping.cos_map(angles)
    return np.log((rho * cos_i).astype(np.float64) + DARK)


def _crowd(photo: NDArray[np.int16], patches: Patches) -> Array:
    """(n,) how many samples share patch and photo with each."""
    key = patches.of * 65536 + photo.astype(np.int64)
    _, where, count = np.unique(key, return_inverse=True, return_counts=True)
    return count[where.ravel()].astype(np.float64)


def _solve(
    patches: Patches,
    slope: Array,
    misfit: Array,
    weight: Array,
    turn: Array,
    deviation: float,
) -> tuple[Array, Array, float]:
    """(turn (p, 3), deviation (p,) along each tangent that is left, the deviation of a scan with
    such corrections (expectation maximisation)): minimises
    Σ w (misfit − slope·Δ)² + |turn|²/σ² + SMOOTH/σ² Σ |turn − neighbour|² over turn."""
    p, of = patches.count, patches.of
    block = np.empty((p, 3, 3))
    for a in range(3):
        for b in range(a, 3):
            block[:, a, b] = np.bincount(of, weight * slope[:, a] * slope[:, b], p)
            block[:, b, a] = block[:, a, b]
    pull = np.stack([np.bincount(of, weight * misfit * slope[:, a], p) for a in range(3)], axis=1)
    pull += np.einsum("pab,pb->pa", block, turn)
    stiff = 1.0 / deviation**2
    block[:, range(3), range(3)] += stiff
    laplacian = SMOOTH * stiff * patches.neighbours
    degree = laplacian.diagonal()
    near = _inverse(block + degree[:, None, None] * np.eye(3))

    def apply(x: Array) -> Array:
        each = x.reshape(p, 3)
        return (np.einsum("pab,pb->pa", block, each) + laplacian @ each).ravel()

    def precondition(x: Array) -> Array:
        return np.einsum("pab,pb->pa", near, x.reshape(p, 3)).ravel()

    shape = (3 * p, 3 * p)
    found, _ = cg(
        LinearOperator(shape, apply, dtype=np.float64),
        pull.ravel(),
        x0=turn.ravel(),
        rtol=1e-2,
        maxiter=40,
        M=LinearOperator(shape, precondition, dtype=np.float64),
    )
    found = found.reshape(p, 3)
    # along the two tangents; the third axis is the prior's own
    trace = np.trace(near, axis1=1, axis2=2) - 1.0 / (stiff + degree)
    cost = np.sum(found**2, axis=1) + SMOOTH * np.sum(found * (patches.neighbours @ found), axis=1)
    share = 1.0 + degree / stiff
    # few large patches are curved: they see all three axes, and the prior's is not the widest then
    again = float(max(np.sqrt(max(np.mean(cost + share * trace), 0.0) / 2), SURE))
    # neighbours tell something of each other: half of what they would if they were known
    alone = _inverse(block + 0.5 * degree[:, None, None] * np.eye(3))
    spread = np.trace(alone, axis1=1, axis2=2) - 1.0 / (stiff + 0.5 * degree)
    return found, np.sqrt(np.maximum(spread, 0.0) / 2), again


def _inverse(blocks: Array) -> Array:
    """Of (p, 3, 3) symmetric positive definite matrices, by cofactors: LAPACK takes them one by
    one, which is most of the time there are so many."""
    first, second, third = blocks[:, 0], blocks[:, 1], blocks[:, 2]
    cofactors = np.stack(
        [np.cross(second, third), np.cross(third, first), np.cross(first, second)], axis=2
    )
    determinant = np.einsum("px,px->p", first, cofactors[:, :, 0])
    inverse: Array = cofactors / determinant[:, None, None]
    return inverse


def _unit(v: Array) -> Array:
    return v / np.maximum(np.linalg.norm(v, axis=1, keepdims=True), 1e-12)
