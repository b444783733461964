"""Two plain ways to describe a surface that varies, to compare with: each is fitted to observations
of nodes, and predicts others.

``lambert_ggx``: a Lambertian colour at each node, and one GGX lobe for all.
``basis_weights``: a few tabulated specular lobes for all, and at each node their weights beside a
Lambertian colour, in turn by non-negative least squares: the method of Tetzlaff, "High-fidelity
specular SVBRDF acquisition from flash photographs" (IEEE TVCG 2023), which Kintsugi 3D Builder
uses, without its estimate of normals.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import minimize, nnls

from patina.core.angles import half_difference
from patina.core.varying.observations import Observations

Array = NDArray[np.floating]

LOBES = 4  # as in the museum's run of Kintsugi 3D Builder
BINS = 24  # of a lobe's table, over the square root of θh
ROUNDS = 12
SWEEPS = 30  # of coordinate descent
SUM_WEIGHT = 0.1  # of the condition that the weights of a node sum to 1
SOME_NODES = 20_000  # that the lobe common to all nodes is fitted to


@dataclass(frozen=True)
class PlainFit:
    """predict: observations → (m, 3) radiance. albedo: (n, 3) Lambertian colour of the nodes."""

    predict: Callable[[Observations], Array]
    albedo: Array


class _Geometry:
    """Angles of observations at nodes with normals (n, 3)."""

    def __init__(self, seen: Observations, normals: Array) -> None:
        normal = normals[seen.node].astype(np.float32)
        angles = half_difference(normal, seen.light, seen.view)
        cosine = np.einsum("ij,ij->i", normal, seen.light)
        view = np.clip(np.einsum("ij,ij->i", normal, seen.view), 0.02, 1)
        self.theta_h = np.clip(angles.theta_h, 0, 0.5 * np.pi)
        cosine = np.clip(cosine, 0.02, 1)
        self.light = seen.irradiance * cosine[:, None]
        half, difference = np.cos(self.theta_h), np.maximum(np.cos(angles.theta_d), 0.02)
        shadow = np.minimum(1, 2 * half * np.minimum(cosine, view) / difference)
        self.cook_torrance = shadow / (4 * cosine * view)  # V-cavities, without D and F
        self.cosines = cosine, view


def lambert_ggx(seen: Observations, normals: Array) -> PlainFit:
    """Fit to observations of n nodes with normals (n, 3), by least squares of the radiance."""
    count = len(normals)
    some = seen.select(np.flatnonzero(seen.node % max(1, count // SOME_NODES) == 0))
    weight = _weight(some)

    def lobe(at: _Geometry, parameters: Array) -> Array:
        alpha, level = np.exp(parameters)
        d = alpha**2 / (np.pi * (np.cos(at.theta_h) ** 2 * (alpha**2 - 1) + 1) ** 2)
        tails = [np.sqrt(alpha**2 + (1 - alpha**2) * c**2) for c in at.cosines]
        masking = 1 / ((at.cosines[1] * tails[0] + at.cosines[0] * tails[1]) * 2)
        found: Array = level * (d * masking)[:, None] * at.light
        return found

    def colour(s: Observations, at: _Geometry, specular: Array, w: Array) -> Array:
        white = at.light / np.pi * w[:, None]
        return np.maximum(_colour(s.node, (s.radiance - specular) * w[:, None], white, count), 0)

    inner = _Geometry(some, normals)

    def cost(parameters: Array) -> float:
        specular = lobe(inner, parameters)
        albedo = colour(some, inner, specular, weight)[some.node]
        error = (albedo / np.pi * inner.light + specular - some.radiance) * weight[:, None]
        return float(np.square(error).mean())

    starts = [minimize(cost, np.log([a, 0.05]), method="Nelder-Mead", options={"maxiter": 60})
              for a in (0.1, 0.3)]  # fmt: skip
    best = min(starts, key=lambda found: found.fun).x
    every = _Geometry(seen, normals)
    albedo = colour(seen, every, lobe(every, best), _weight(seen))

    def predict(other: Observations) -> Array:
        at = _Geometry(other, normals)
        return albedo[other.node] / np.pi * at.light + lobe(at, best)

    return PlainFit(predict, albedo)


def basis_weights(seen: Observations, normals: Array, lobes: int = LOBES) -> PlainFit:
    """Fit to observations of n nodes with normals (n, 3), relative to their radiance."""
    count = len(normals)
    at = _Geometry(seen, normals)
    w = _weight(seen).astype(np.float32)
    white = (at.light / np.pi * w[:, None]).astype(np.float32)
    target = (seen.radiance * w[:, None]).astype(np.float32)
    specular = (at.cook_torrance[:, None] * at.light * w[:, None]).astype(np.float32)
    step = _steps(at.theta_h)
    state = _start(seen, target, white, count, lobes)
    tables = np.zeros((lobes, BINS, 3))
    for _ in range(ROUNDS):
        albedo, weights = state[:, :3], state[:, 3:]
        rest = target - albedo[seen.node] * white
        tables = _tables(step, specular, rest, weights[seen.node])
        values = np.einsum("mb,kbc->mkc", step, tables)
        state = _weights(seen.node, white, specular, values, target, state)

    def predict(other: Observations) -> Array:
        here = _Geometry(other, normals)
        of = state[other.node]
        d = np.einsum("mb,kbc,mk->mc", _steps(here.theta_h), tables, of[:, 3:])
        return (of[:, :3] / np.pi + d * here.cook_torrance[:, None]) * here.light

    return PlainFit(predict, state[:, :3])


def _weight(seen: Observations) -> Array:
    """(m,) weights of observations: about the inverse of their radiance."""
    found: Array = 1 / (seen.radiance.mean(axis=1) + np.median(seen.radiance))
    return found


def _colour(node: NDArray[np.integer], target: Array, white: Array, count: int) -> Array:
    """(n, 3) factors of ``white`` (m, 3) that fit ``target`` (m, 3) at each node by least squares;
    where nothing was observed, those of the whole surface."""
    up, down = (
        np.stack([np.bincount(node, channel, count) for channel in values.T], axis=1)
        for values in (target * white, white**2)
    )
    mean = up.sum(axis=0) / down.sum(axis=0)
    return np.where(down > 0, up / np.maximum(down, 1e-20), mean)


def _steps(theta_h: Array) -> NDArray[np.float32]:
    """(m, BINS) weights of the linear interpolation between the entries of a table."""
    place = np.sqrt(theta_h / (0.5 * np.pi)) * (BINS - 1)
    low = np.minimum(place.astype(int), BINS - 2)
    out = np.zeros((len(place), BINS), np.float32)
    rows = np.arange(len(place))
    out[rows, low], out[rows, low + 1] = 1 - (place - low), place - low
    return out


def _start(
    seen: Observations, target: Array, white: Array, count: int, lobes: int
) -> NDArray[np.float32]:
    """(n, 3 + lobes): colours by least squares, and a lobe for each group of similar colours."""
    from scipy.cluster.vq import kmeans2

    albedo = _colour(seen.node, target, white, count)
    _, group = kmeans2(albedo[::7], lobes, minit="++", seed=0)
    centres = np.stack([albedo[::7][group == k].mean(axis=0) for k in range(lobes)])
    nearest = np.argmin(np.square(albedo[:, None] - centres[None]).sum(axis=2), axis=1)
    weights = np.eye(lobes)[nearest]
    return np.concatenate([0.5 * albedo, weights], axis=1).astype(np.float32)


def _tables(step: Array, specular: Array, rest: Array, weights: Array) -> Array:
    """(lobes, BINS, 3) tables of lobes that decrease with θh."""
    lobes = weights.shape[1]
    below = np.cumsum(np.eye(BINS), axis=1)  # entry b is the sum of the decreases from b on
    decrease = np.zeros((lobes, BINS, 3))
    for channel in range(3):
        rows = step * specular[:, channel, None]
        normal, right = np.zeros((lobes, BINS, lobes, BINS)), np.zeros((lobes, BINS))
        for i in range(lobes):
            own = rows * weights[:, i, None]
            right[i] = own.T @ rest[:, channel]
            for j in range(lobes):
                normal[i, :, j] = own.T @ (rows * weights[:, j, None])
        turn = np.kron(np.eye(lobes), below)
        a = turn.T @ normal.reshape(lobes * BINS, -1) @ turn
        a[np.diag_indices_from(a)] += 1e-6 * np.trace(a) / len(a)
        factor = np.linalg.cholesky(a)
        b = np.linalg.solve(factor, turn.T @ right.ravel())
        decrease[:, :, channel] = nnls(factor.T, b)[0].reshape(lobes, BINS)
    return np.cumsum(decrease[:, ::-1], axis=1)[:, ::-1]


def _weights(
    node: NDArray[np.integer], white: Array, specular: Array, values: Array, target: Array,
    state: Array,
) -> NDArray[np.float32]:  # fmt: skip
    """(n, 3 + lobes) colours and weights: non-negative least squares by coordinate descent."""
    count, size = state.shape
    lobes = size - 3
    columns = np.zeros((*target.shape, size), np.float32)
    for channel in range(3):
        columns[:, channel, channel] = white[:, channel]
    columns[:, :, 3:] = np.einsum("mc,mkc->mck", specular, values)
    normal, right = np.zeros((count, size, size)), np.zeros((count, size))
    for i in range(size):
        right[:, i] = np.bincount(node, (columns[:, :, i] * target).sum(axis=1), count)
        for j in range(size):
            both = (columns[:, :, i] * columns[:, :, j]).sum(axis=1)
            normal[:, i, j] = np.bincount(node, both, count)
    level = SUM_WEIGHT * np.trace(normal[:, 3:, 3:], axis1=1, axis2=2) / lobes + 1e-12
    normal[:, 3:, 3:] += level[:, None, None]
    right[:, 3:] += level[:, None]
    found = state.astype(np.float64)
    for _ in range(SWEEPS):
        for i in range(size):
            slope = right[:, i] - np.einsum("nj,nj->n", normal[:, i], found)
            found[:, i] = np.maximum(found[:, i] + slope / (normal[:, i, i] + 1e-12), 0)
    return found.astype(np.float32)
