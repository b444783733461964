"""Refine the scan's normals from the photos, given the BRDF (left as future work by Ono et al.
2019).

Each patch of the surface gets one small rotation, estimated from all lit photos of it. Penalties on
its size, relative to the expected error of the scan's normals, and on its difference to the
neighbouring patches regularise it. Where the BRDF is flat the photos hold no information on the
normals, and those of the scan remain.
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
from ...statistics.student_t import weights_of_squares
from .patches import Patches

Array = NDArray[np.float64]

ROUNDS = 3  # linearisations
DIFFERENCE_STEP = 2e-3  # radians, of the finite differences
MIN_REFLECTED = 2e-3  # L/E, added inside the logarithm: below it photos show noise
TOLERANCE = 0.05  # log-relative standard deviation of a BRDF that is like the measured materials
SMOOTHNESS = 0.3  # penalty on a difference to a neighbour, relative to that on the rotation itself
MAX_ROTATION = np.radians(12.0)
MIN_DEVIATION = np.radians(0.01)  # lower limit of the estimated standard deviation of normals


@dataclass(frozen=True)
class RefinedNormals:
    """table: the samples with their refined normals. error: (n,) radians, standard deviation along
    each tangent of the remaining error. deviation: radians along each tangent, standard deviation
    of the scan's normals, estimated from the refinement."""

    table: SampleTable
    error: NDArray[np.float64]
    deviation: float


def refine_normals(
    scanned: SampleTable,
    patches: Patches,
    brdf: LogTable,
    deviation: float,
    tolerance: float = TOLERANCE,
    clipped: NDArray[np.bool_] | None = None,
) -> RefinedNormals:
    """Refine the normals of samples.

    scanned: samples with the scan's normals. brdf: log table of the BRDF. deviation: radians along
    each tangent, expected standard deviation of the scan's normals. tolerance: log-relative
    standard deviation of the BRDF itself. clipped: (n,) samples whose radiance is a lower limit,
    which are ignored; None where there are none.
    """
    grey = brdf.grey()
    normal = scanned.normal.astype(np.float64)
    seen = (scanned.radiance / scanned.irradiance).mean(axis=1, dtype=np.float64)
    observed = np.log(np.maximum(seen, 0.0) + MIN_REFLECTED)
    turn = np.zeros((patches.count, 3))
    used = np.ones(len(scanned), bool) if clipped is None else ~clipped
    sharing = np.where(used, _samples_sharing_error(scanned.photo, patches, used), np.inf)
    for _ in range(ROUNDS):
        turned = _unit(normal + turn[patches.of])
        slope, misfit = _linearised(grey, turned, scanned, observed)
        weight = weights_of_squares((misfit / tolerance) ** 2) / tolerance**2
        # samples of one patch and photo share the model's error: together they count as one
        weight = weight / sharing
        turn, left, scan_deviation = _solve(patches, slope, misfit, weight, turn, deviation)
        size = np.linalg.norm(turn, axis=1, keepdims=True)
        turn = turn * np.minimum(1.0, MAX_ROTATION / np.maximum(size, 1e-12))
    turned = _unit(normal + turn[patches.of])
    return RefinedNormals(with_normals(scanned, turned), left[patches.of], scan_deviation)


def with_normals(table: SampleTable, normal: Array) -> SampleTable:
    """The same samples with other unit normals (n, 3): angles, cosines and ρ are computed anew."""
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
    """(∂ ln L/∂n (n, 3) in the tangent plane, residual (n,) of ln L)."""
    first, second = tangents(normal)
    base = _log_reflected(grey, normal, table)
    one = (
        _log_reflected(grey, _unit(normal + DIFFERENCE_STEP * first), table) - base
    ) / DIFFERENCE_STEP
    two = (
        _log_reflected(grey, _unit(normal + DIFFERENCE_STEP * second), table) - base
    ) / DIFFERENCE_STEP
    return one[:, None] * first + two[:, None] * second, observed - base


def _log_reflected(grey: LogTable, normal: Array, table: SampleTable) -> Array:
    """(n,) ln(ρ·cos θi + MIN_REFLECTED) predicted for unit normals (n, 3)."""
    n = normal.astype(np.float32)
    angles = half_difference(n, table.light, table.view)
    cos_i = np.maximum(dot(n, table.light), np.float32(0.02))
    level = np.exp(grey.logs(angles)[:, 0]) - np.float32(mapping.EPSILON)
    rho = np.maximum(level, 0.0) / mapping.cos_map(angles)
    return np.log((rho * cos_i).astype(np.float64) + MIN_REFLECTED)


def _samples_sharing_error(
    photo: NDArray[np.int16], patches: Patches, used: NDArray[np.bool_]
) -> Array:
    """(n,) how many samples that are ``used`` (n,) have the same patch and photo as each."""
    key = patches.of * 65536 + photo.astype(np.int64)
    where = np.unique(key, return_inverse=True)[1].ravel()
    return np.asarray(np.bincount(where, used)[where])


def _solve(
    patches: Patches,
    slope: Array,
    misfit: Array,
    weight: Array,
    turn: Array,
    deviation: float,
) -> tuple[Array, Array, float]:
    """One linearised step: minimises Σ w (misfit − slope·Δ)² + |turn|²/σ² + SMOOTHNESS/σ² Σ |turn −
    neighbour|² over turn.

    Returns (turn (p, 3), standard deviation (p,) along each tangent of the remaining error,
    standard deviation of the scan's normals by expectation maximisation).
    """
    p, of = patches.count, patches.of
    block = np.empty((p, 3, 3))
    for a in range(3):
        for b in range(a, 3):
            block[:, a, b] = np.bincount(of, weight * slope[:, a] * slope[:, b], p)
            block[:, b, a] = block[:, a, b]
    pull = np.stack([np.bincount(of, weight * misfit * slope[:, a], p) for a in range(3)], axis=1)
    pull += np.einsum("pab,pb->pa", block, turn)
    precision = 1.0 / deviation**2
    block[:, range(3), range(3)] += precision
    laplacian = SMOOTHNESS * precision * patches.neighbours
    degree = laplacian.diagonal()
    block_inverse = _inverse(block + degree[:, None, None] * np.eye(3))

    def apply(x: Array) -> Array:
        each = x.reshape(p, 3)
        return (np.einsum("pab,pb->pa", block, each) + laplacian @ each).ravel()

    def precondition(x: Array) -> Array:
        return np.einsum("pab,pb->pa", block_inverse, x.reshape(p, 3)).ravel()

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
    # variance along the two tangents: that of the third axis, the prior's, is subtracted
    trace = np.trace(block_inverse, axis1=1, axis2=2) - 1.0 / (precision + degree)
    cost = np.sum(found**2, axis=1) + SMOOTHNESS * np.sum(
        found * (patches.neighbours @ found), axis=1
    )
    share = 1.0 + degree / precision
    # large patches are curved, so data constrain all three axes: the difference can be negative
    scan_deviation = float(max(np.sqrt(max(np.mean(cost + share * trace), 0.0) / 2), MIN_DEVIATION))
    # neighbours carry half the information that they would if their rotations were known
    conditional = _inverse(block + 0.5 * degree[:, None, None] * np.eye(3))
    spread = np.trace(conditional, axis1=1, axis2=2) - 1.0 / (precision + 0.5 * degree)
    return found, np.sqrt(np.maximum(spread, 0.0) / 2), scan_deviation


def _inverse(blocks: Array) -> Array:
    """Inverses of (p, 3, 3) symmetric positive definite matrices, by cofactors: LAPACK inverts them
    one by one, which dominated the running time."""
    first, second, third = blocks[:, 0], blocks[:, 1], blocks[:, 2]
    cofactors = np.stack(
        [np.cross(second, third), np.cross(third, first), np.cross(first, second)], axis=2
    )
    determinant = np.einsum("px,px->p", first, cofactors[:, :, 0])
    inverse: Array = cofactors / determinant[:, None, None]
    return inverse


def _unit(v: Array) -> Array:
    """Vectors (n, 3) scaled to unit length."""
    return v / np.maximum(np.linalg.norm(v, axis=1, keepdims=True), 1e-12)
