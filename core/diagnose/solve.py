"""Fit coefficients and the numbers of effects to the pixels, all at once.

Gauss–Newton on a robust likelihood. Coefficients of one material and channel see those of another
only through the effects: the matrix is an arrow, and the coefficients are eliminated block by block
(Schur complement). So the BRDF cannot swallow an effect, nor an effect the BRDF, without the other
being offered the same.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from ..basis import mapping
from .model import Model

Array = NDArray[np.floating]
Vector = NDArray[np.float64]

DEGREES = 4.0  # of freedom of the Student t
STEPS, HALVINGS = 25, 5
SETTLED = 1e-4  # of the cost
RISE = 1e-3  # relative, for the slope of what the camera does


@dataclass(frozen=True)
class Fitted:
    """model at its optimum. deviation: (n, 3) of every pixel, fixed; shown: (n, 3) the prediction;
    residual: (n, 3) what photos show more, in units of the deviation. cost: of the pixels, in nats,
    the prior not counted."""

    model: Model
    deviation: Array
    shown: Array
    residual: Array
    cost: float

    @property
    def numbers(self) -> Vector:
        """All numbers of all effects, one after the other."""
        return np.concatenate([*self.model.x, np.zeros(0)])


@dataclass(frozen=True)
class Slopes:
    """rho: (n, 3) ∂ residual/∂ ln(ρ·cosMap + ε), by which Q̂ is multiplied; q: (n, k); x: (n, 3, p)
    ∂ prediction/∂ numbers in units of the pixels' deviation."""

    rho: Array
    q: Array
    x: Array


def robust(residual: Array) -> Array:
    """Cost of residuals in units of their deviation, nats (Student t)."""
    return (DEGREES + 1) / 2 * np.log1p(np.square(residual) / DEGREES)


def weights(residual: Array) -> Array:
    """Of the residuals' squares in Gauss–Newton."""
    return (DEGREES + 1) / (DEGREES + np.square(residual))


def fit(model: Model, deviation: Array, steps: int = STEPS) -> Fitted:
    """From the model as it is; deviation: (n, 3) radiance, inf where a pixel does not count."""
    now = _at(model, deviation)
    for _ in range(steps):
        found = _stepped(now)
        gained = _whole(now) - _whole(found)
        now = found if gained > 0 else now
        if gained < SETTLED * max(now.cost, 1.0):
            break
    return now


def slopes_of(fitted: Fitted) -> Slopes:
    """At the model's present numbers."""
    model, deviation = fitted.model, fitted.deviation
    now = model.situation()
    angles = now.angles
    q, weight = model.brdfs.rows(angles)
    rho = model.brdfs.evaluate(angles, model.pixels.material)
    received = now.received
    reflected = rho * received
    entering = model.entering(reflected, now)
    recorded = model.recorded(entering, now)
    grown = (1 + RISE) * entering
    camera = (model.recorded(grown, now) - recorded) / np.where(entering > 0, RISE * entering, 1)
    camera = np.where(entering > 0, camera, 1.0)
    per_log = (rho + mapping.EPSILON / weight[:, None]) * received * camera / deviation
    per_number = [
        (_moved(model, place, index) - recorded) / (step * deviation)
        for place, effect in enumerate(model.effects)
        for index, step in enumerate(effect.numbers.step)
    ]
    shape = (*recorded.shape, len(per_number))
    x = np.stack(per_number, axis=2) if per_number else np.zeros(shape)
    return Slopes(per_log.astype(np.float32), q, x)


def _moved(model: Model, place: int, index: int) -> Array:
    """The prediction with one number a step on."""
    x = [numbers.copy() for numbers in model.x]
    x[place][index] += model.effects[place].numbers.step[index]
    return model.predicted(x)


def _at(model: Model, deviation: Array) -> Fitted:
    shown = model.predicted()
    residual = (model.pixels.observed - shown) / deviation
    return Fitted(model, deviation, shown, residual, float(robust(residual).sum()))


def _prior(model: Model) -> float:
    c = model.brdfs.coefficients
    cost = 0.5 * float(np.sum(c**2 / model.brdfs.variance))
    for effect, x in zip(model.effects, model.x, strict=True):
        cost += 0.5 * float(np.sum((x / effect.numbers.deviation) ** 2))
    return cost


def _whole(fitted: Fitted) -> float:
    return fitted.cost + _prior(fitted.model)


@dataclass(frozen=True)
class Equations:
    """Sums over pixels. blocks: (m, 3, k, k) of each material's and channel's coefficients;
    coupling: (m, 3, k, p); own: (p, p); pull: (m, 3, k); own_pull: (p,). Without the prior."""

    blocks: Array
    coupling: Array
    own: Array
    pull: Array
    own_pull: Vector

    @classmethod
    def of(cls, fitted: Fitted, slopes: Slopes, rows: NDArray[np.intp]) -> Equations:
        """Of some pixels."""
        coefficients = fitted.model.brdfs.coefficients
        m, _, k = coefficients.shape
        p = slopes.x.shape[2]
        blocks, coupling = np.zeros((m, 3, k, k)), np.zeros((m, 3, k, p))
        own, pull, own_pull = np.zeros((p, p)), np.zeros((m, 3, k)), np.zeros(p)
        material = fitted.model.pixels.material[rows]
        for index in range(m):
            mine = rows[material == index]
            if not len(mine):
                continue
            q = slopes.q[mine]
            for c in range(3):
                r = fitted.residual[mine, c]
                w = weights(r).astype(np.float32)
                a = q * slopes.rho[mine, c, None]
                weighted = a * w[:, None]
                x = slopes.x[mine, c].astype(np.float32)
                blocks[index, c] = weighted.T @ a
                pull[index, c] = weighted.T @ r.astype(np.float32)
                coupling[index, c] = weighted.T @ x
                own += (x * w[:, None]).T @ x
                own_pull += (x * w[:, None]).T @ r.astype(np.float32)
        return cls(blocks, coupling, own, pull, own_pull)

    def plus(self, other: Equations, times: float = 1.0) -> Equations:
        """With those of other pixels; times −1: without them."""
        return Equations(
            self.blocks + times * other.blocks,
            self.coupling + times * other.coupling,
            self.own + times * other.own,
            self.pull + times * other.pull,
            self.own_pull + times * other.own_pull,
        )

    def solved(self, fitted: Fitted) -> tuple[Array, Vector, Array]:
        """(change of the coefficients (m, 3, k), of the numbers (p,), covariance (p, p) of these),
        the prior included."""
        model = fitted.model
        variance = model.brdfs.variance
        m, _, k = model.brdfs.coefficients.shape
        usual = model.usual
        own = self.own + np.diag(1 / usual**2)
        right = self.own_pull - fitted.numbers / usual**2
        pull = self.pull - model.brdfs.coefficients / variance
        eliminated = {}
        for index in range(m):
            for c in range(3):
                block = self.blocks[index, c] + np.diag(1 / variance)
                both = np.column_stack([self.coupling[index, c], pull[index, c]])
                found = np.linalg.solve(block, both)
                eliminated[index, c] = found
                own = own - self.coupling[index, c].T @ found[:, :-1]
                right = right - self.coupling[index, c].T @ found[:, -1]
        free = _free(fitted, right)
        covariance = np.zeros_like(own)
        covariance[np.ix_(free, free)] = np.linalg.inv(own[np.ix_(free, free)])
        x = covariance @ right
        change = np.zeros((m, 3, k))
        for (index, c), found in eliminated.items():
            change[index, c] = found[:, -1] - found[:, :-1] @ x
        return change, x, covariance


def scores(fitted: Fitted, slopes: Slopes, of: NDArray[np.intp], last: int) -> tuple[Array, Array]:
    """((b, last) what each group ``of`` pixels (n,) pulls at the last numbers, the part that all
    other unknowns could follow taken out; (last, last) inverse of these numbers' information)."""
    model, n = fitted.model, len(of)
    whole = Equations.of(fitted, slopes, np.arange(n))
    variance = model.brdfs.variance
    groups = int(of.max()) + 1
    p = slopes.x.shape[2]
    own = whole.own + np.diag(1 / model.usual**2)
    pull = np.zeros((groups, p))
    for index in range(len(model.brdfs.coefficients)):
        mine = np.flatnonzero(model.pixels.material == index)
        for c in range(3):
            block = whole.blocks[index, c] + np.diag(1 / variance)
            projector = np.linalg.solve(block, whole.coupling[index, c])  # (k, p)
            own = own - whole.coupling[index, c].T @ projector
            r = fitted.residual[mine, c]
            wr = weights(r) * r
            left = slopes.x[mine, c] - slopes.rho[mine, c, None] * (slopes.q[mine] @ projector)
            for j in range(p):
                pull[:, j] += np.bincount(of[mine], wr * left[:, j], groups)
    first = p - last
    if first:
        others = np.linalg.solve(own[:first, :first], own[:first, first:])
        pull = pull[:, first:] - pull[:, :first] @ others
        own = own[first:, first:] - own[first:, :first] @ others
    return pull, np.linalg.inv(own)


def _free(fitted: Fitted, pull: Vector) -> NDArray[np.intp]:
    """Places of the numbers that are not held by a bound."""
    bounds = [(e.numbers.low, e.numbers.high) for e in fitted.model.effects]
    low = np.concatenate([b[0] for b in bounds] + [np.zeros(0)])
    high = np.concatenate([b[1] for b in bounds] + [np.zeros(0)])
    x = fitted.numbers
    return np.flatnonzero(~(((x <= low) & (pull <= 0)) | ((x >= high) & (pull >= 0))))


def _stepped(now: Fitted) -> Fitted:
    """A Gauss–Newton step, shortened until it helps; numbers stay within their bounds."""
    slopes = slopes_of(now)
    everything = np.arange(len(now.residual))
    change, x, _ = Equations.of(now, slopes, everything).solved(now)
    before = _whole(now)
    share = 1.0
    best = now
    for _ in range(HALVINGS):
        model = _with(now.model, share * change, share * x)
        best = _at(model, now.deviation)
        if _whole(best) < before:
            break
        share /= 2
    return best


def _with(model: Model, change: Array, x: Vector) -> Model:
    brdfs = replace(model.brdfs, coefficients=model.brdfs.coefficients + change)
    parts, at = [], 0
    for effect, old in zip(model.effects, model.x, strict=True):
        numbers = effect.numbers
        step = x[at : at + len(numbers)]
        parts.append(np.clip(old + step, numbers.low, numbers.high))
        at += len(numbers)
    return replace(model, brdfs=brdfs, x=tuple(parts))
