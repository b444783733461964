"""Which parameters of a material vary over its surface, by photos that were held out."""

from __future__ import annotations

from collections.abc import Generator, Iterator, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from ..statistics.student_t import robust_cost
from .hierarchy import MIN_ERROR, NodeFields, edges_of_levels, near_black, robust_deviation, solve
from .node_model import COUNT, TILT, NodeModel
from .observations import Observations
from .varying_surface import EVEN, VARIATIONS, MaterialVariation

FOLDS = 3  # groups of photos, each held out once
MAX_SINGLE_PHOTOS = 6  # up to so many, each photo is a group: two are too many to leave out
MIN_PHOTOS = 3  # with fewer, one photo cannot be predicted from the others
STANDARD_ERRORS = 2.0  # of the difference over photos by which a more varied kind must be better
MAX_RMS_GROWTH = 1.02  # highlights, which the cost hardly sees, may hardly be predicted worse
MIN_GAIN = 0.1  # relative decrease of the error of held-out photos that makes a surface uneven
MIN_VARIATION = 0.02  # relative, explained by what varies: a smaller difference is hardly visible
MIN_NORMAL_ERROR = float(np.radians(0.5))  # that remains with tilts, or of a very good scan
CHUNK = 1 << 17


@dataclass(frozen=True)
class Nodes:
    """n nodes of one material. points, normals: (n, 3), scan frame; spacing: distance of
    neighbouring nodes; mesh_edge: mean length of an edge of the mesh; both in scan units;
    normal_error: standard deviation of the error of the normals, radians along each tangent."""

    points: NDArray[np.float64]
    normals: NDArray[np.float32]
    spacing: float
    mesh_edge: float
    normal_error: float = MIN_NORMAL_ERROR

    def solve(
        self, model: NodeModel, seen: Observations, kind: str
    ) -> Iterator[tuple[float, NodeFields]]:
        """The fields of what a key of VARIATIONS lets vary; see hierarchy.solve."""
        free = np.zeros(COUNT, bool)
        free[list(VARIATIONS[kind])] = True
        edges = edges_of_levels(self.points, self.spacing)
        error = MIN_NORMAL_ERROR if free[TILT].any() else self.normal_error
        return solve(model, seen, self.points, self.normals, edges, free, self.mesh_edge, error)


def choose(
    model: NodeModel, seen: Observations, nodes: Nodes, kinds: Sequence[str]
) -> Generator[float, None, MaterialVariation]:
    """Choose one of ``kinds``, simplest first, by cross-validation over photos; yields the fraction
    done.

    The simplest kind is kept unless a more varied one predicts held-out photos better, by
    STANDARD_ERRORS of the difference over photos, without a larger RMS error of the radiance; for
    an even material also by MIN_GAIN and MIN_VARIATION. Only nodes count that a fitted photo shows
    too: of others, the photos say nothing. With fewer than MIN_PHOTOS it is the first.
    """
    photos = np.unique(seen.photo)
    if len(photos) < MIN_PHOTOS:
        return MaterialVariation(kinds[0])
    black = near_black(seen)
    zero = np.zeros((len(nodes.points), COUNT), np.float32)
    residual, _, _ = _errors(model, seen, nodes, zero, black)
    error = max(robust_deviation(residual), MIN_ERROR)
    costs: dict[str, list[float]] = {kind: [] for kind in kinds}
    typical: dict[str, list[float]] = {kind: [] for kind in kinds}
    rms: dict[str, list[float]] = {kind: [] for kind in kinds}
    count = len(photos) if len(photos) <= MAX_SINGLE_PHOTOS else FOLDS
    folds = [photos[k::count] for k in range(count)]
    done, total = 0, len(folds) * len(kinds)
    for fold in folds:
        out = np.isin(seen.photo, fold)
        fitted = seen.select(~out)
        shown = np.zeros(len(nodes.points), bool)
        shown[fitted.node] = True
        held = seen.select(out & shown[seen.node])
        for kind in kinds:
            theta = zero
            if VARIATIONS[kind] and len(fitted):
                for _, fields in nodes.solve(model, fitted, kind):
                    theta = fields.parameters
            residual, relative, difference = _errors(model, held, nodes, theta, black)
            for photo in fold:
                own = held.photo == photo
                if not own.any():
                    continue
                costs[kind].append(float(robust_cost(residual[own] / error).mean()))
                typical[kind].append(float(np.median(relative[own])))
                square = np.square(difference[own]).mean()
                rms[kind].append(float(np.sqrt(square / np.square(held.radiance[own]).mean())))
            done += 1
            yield done / total
    chosen = kinds[0]
    if len(costs[chosen]) < MIN_PHOTOS:
        return MaterialVariation(chosen)
    for kind in kinds[1:]:
        gain = np.array(costs[chosen]) - np.array(costs[kind])
        sure = gain.mean() > STANDARD_ERRORS * gain.std(ddof=1) / np.sqrt(len(gain))
        sure &= np.mean(rms[kind]) < MAX_RMS_GROWTH * np.mean(rms[chosen])
        before, after = np.mean(typical[chosen]), np.mean(typical[kind])
        if chosen == EVEN:
            sure &= after < (1 - MIN_GAIN) * before and before**2 - after**2 > MIN_VARIATION**2
        if sure and after < before:
            chosen = kind
    return MaterialVariation(chosen, _means(costs), _means(typical))


def _means(values: dict[str, list[float]]) -> dict[str, float]:
    return {kind: float(np.mean(found)) for kind, found in values.items()}


def _errors(
    model: NodeModel,
    seen: Observations,
    nodes: Nodes,
    theta: NDArray[np.float32],
    black: float,
) -> tuple[NDArray[np.floating], NDArray[np.floating], NDArray[np.floating]]:
    """(measured minus predicted logarithm of the radiance, relative error, error of the radiance),
    each (m, 3)."""
    log, relative, error = np.empty((3, len(seen), 3), np.float32)
    for begin in range(0, len(seen), CHUNK):
        part = slice(begin, begin + CHUNK)
        some = seen.select(part)
        predicted = model.radiance(some.shading, nodes.normals[some.node], theta[some.node])
        measured = np.maximum(some.radiance, 0)
        log[part] = np.log(measured + black) - np.log(predicted + black)
        error[part] = predicted - measured
        relative[part] = np.abs(error[part]) / np.maximum(measured, black)
    return log, relative, error
