"""Which parameters of a material vary over its surface, by photos that were held out."""

from __future__ import annotations

from collections.abc import Generator
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from ..statistics.student_t import robust_cost
from .hierarchy import BLACK_SHARE, edges_of_levels, solve
from .node_model import COUNT, NodeModel
from .observations import Observations
from .varying_surface import VARIATIONS, MaterialVariation

FOLDS = 4  # groups of photos, each held out once
MIN_PHOTOS = 3  # with fewer, one photo cannot be predicted from the others
MIN_ERROR = 0.01  # of the logarithm of the radiance
STANDARD_ERRORS = 2.0  # of the difference over photos by which a more varied kind must be better
MIN_GAIN = 0.02  # relative decrease of the error that makes a surface uneven
CHUNK = 1 << 17


@dataclass(frozen=True)
class Nodes:
    """n nodes of one material. points, normals: (n, 3), scan frame; spacing: distance of
    neighbouring nodes, scan units."""

    points: NDArray[np.float64]
    normals: NDArray[np.float32]
    spacing: float


def choose(
    model: NodeModel, seen: Observations, nodes: Nodes
) -> Generator[float, None, MaterialVariation]:
    """Choose a key of VARIATIONS by cross-validation over photos; yields the fraction done.

    The simplest kind is kept unless a more varied one predicts held-out photos better, by
    STANDARD_ERRORS of the difference over photos. With fewer than MIN_PHOTOS it is "even".
    """
    photos = np.unique(seen.photo)
    if len(photos) < MIN_PHOTOS:
        return MaterialVariation("even", {})
    black = BLACK_SHARE * float(np.median(seen.radiance.mean(axis=1)))
    zero = np.zeros((len(nodes.points), COUNT), np.float32)
    error = max(float(np.median(np.abs(_residual(model, seen, nodes, zero, black)))), MIN_ERROR)
    error /= 0.6745
    costs: dict[str, list[float]] = {kind: [] for kind in VARIATIONS}
    sizes: dict[str, list[float]] = {kind: [] for kind in VARIATIONS}
    folds = [photos[k::FOLDS] for k in range(min(FOLDS, len(photos)))]
    done, total = 0, len(folds) * len(VARIATIONS)
    for fold in folds:
        out = np.isin(seen.photo, fold)
        fitted, held = seen.select(~out), seen.select(out)
        for kind, which in VARIATIONS.items():
            theta = zero
            if which and len(fitted):
                free = np.zeros(COUNT, bool)
                free[list(which)] = True
                edges = edges_of_levels(nodes.points, nodes.spacing)
                for _, fields in solve(model, fitted, nodes.points, nodes.normals, edges, free):
                    theta = fields.parameters
            residual = _residual(model, held, nodes, theta, black)
            for photo in fold:
                own = residual[held.photo == photo]
                costs[kind].append(float(robust_cost(own / error).mean()))
                sizes[kind].append(float(np.median(np.abs(own))))
            done += 1
            yield done / total
    chosen = "even"
    for kind in list(VARIATIONS)[1:]:
        gain = np.array(costs[chosen]) - np.array(costs[kind])
        sure = gain.mean() > STANDARD_ERRORS * gain.std(ddof=1) / np.sqrt(len(gain))
        least = MIN_GAIN if chosen == "even" else 0.0
        if sure and np.mean(sizes[kind]) < (1 - least) * np.mean(sizes[chosen]):
            chosen = kind
    return MaterialVariation(chosen, {kind: float(np.mean(c)) for kind, c in costs.items()})


def _residual(
    model: NodeModel,
    seen: Observations,
    nodes: Nodes,
    theta: NDArray[np.float32],
    black: float,
) -> NDArray[np.floating]:
    """(m, 3) measured minus predicted logarithm of the radiance."""
    out = np.empty((len(seen), 3), np.float32)
    for begin in range(0, len(seen), CHUNK):
        part = slice(begin, begin + CHUNK)
        some = seen.select(part)
        predicted = model.radiance(some.shading, nodes.normals[some.node], theta[some.node])
        out[part] = np.log(np.maximum(some.radiance, 0) + black) - np.log(predicted + black)
    return out
