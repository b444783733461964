"""Which parameters of a material vary over its surface, by photos that were held out."""

from __future__ import annotations

from collections.abc import Generator, Iterator, Sequence
from dataclasses import dataclass, field, replace

import numpy as np
from numpy.typing import NDArray

from ..concurrency.thread_pool import thread_count, thread_pool
from ..statistics.student_t import robust_cost
from .hierarchy import NodeFields, edges_of_levels, solve
from .node_model import COUNT, TILT, NodeModel
from .observations import Observations
from .radiance_error import MIN_ERROR, near_black, robust_deviation
from .varying_surface import EVEN, VARIATIONS, MaterialVariation

FOLDS = 3  # groups of photos, each held out once
MAX_SINGLE_PHOTOS = 6  # up to so many, each photo is a group: two are too many to leave out
MIN_PHOTOS = 3  # with fewer, one photo cannot be predicted from the others
STANDARD_ERRORS = 2.0  # over photos, of the gain by which another kind than the first is better
FURTHER_STANDARD_ERRORS = 1.0  # by which a still more varied one is (Breiman et al. 1984)
MIN_GAIN = 0.1  # relative decrease of the error of held-out photos that makes a surface uneven
MIN_VARIATION = 0.03  # relative, explained by what varies: about one step of L*, hardly visible
MIN_NORMAL_ERROR = float(np.radians(0.5))  # that remains with tilts, or of a very good scan
CHUNK = 1 << 17


@dataclass(frozen=True)
class Nodes:
    """n nodes of one material. points, normals: (n, 3), scan frame; spacing: distance of
    neighbouring nodes; mesh_edge: mean length of an edge of the mesh; both in scan units;
    normal_error: standard deviation of the error of the normals, radians along each tangent.
    threads: that estimate, None for one a core."""

    points: NDArray[np.float64]
    normals: NDArray[np.float32]
    spacing: float
    mesh_edge: float
    normal_error: float = MIN_NORMAL_ERROR
    threads: int | None = None

    def select(self, rows: NDArray[np.intp]) -> Nodes:
        """Some of the nodes."""
        return replace(self, points=self.points[rows], normals=self.normals[rows])

    def solve(
        self, model: NodeModel, seen: Observations, kind: str
    ) -> Iterator[tuple[float, NodeFields]]:
        """The fields of what a key of VARIATIONS lets vary, always with the colour of the surface;
        see hierarchy.solve."""
        free = np.zeros(COUNT, bool)
        free[[*VARIATIONS[kind], *model.colour]] = True
        edges = edges_of_levels(self.points, self.spacing)
        error = MIN_NORMAL_ERROR if free[TILT].any() else self.normal_error
        with thread_pool(thread_count(self.threads)) as pool:
            yield from solve(
                model, seen, self.points, self.normals, edges, free, self.mesh_edge, error, pool
            )

    def estimate(self, model: NodeModel, seen: Observations, kind: str) -> NDArray[np.float32]:
        """(n, 10) parameters of the nodes after the finest level, 0 where nothing can vary."""
        theta = np.zeros((len(self.points), COUNT), np.float32)
        if VARIATIONS[kind] and len(seen):
            for _, fields in self.solve(model, seen, kind):
                theta = fields.parameters
        return theta


def choose(
    candidates: Sequence[tuple[str, NodeModel]],
    seen: Observations,
    nodes: Nodes,
    highlights: bool = True,
) -> Generator[float, None, MaterialVariation]:
    """Choose what varies by cross-validation over photos; yields the fraction done.

    candidates: (kind, model with which it is estimated), simplest first. The simplest is kept
    unless a more varied one predicts held-out photos better: by STANDARD_ERRORS over photos of the
    logarithm of the cost (FURTHER_STANDARD_ERRORS better than a kind that is already preferred to
    the simplest); with ``highlights`` by a factor that is larger than that by which the RMS error
    of the radiance grows, which is mostly that of highlights; and for an even material by MIN_GAIN
    and MIN_VARIATION. The error is the mean absolute one of the logarithm (the median does not show
    a second material on less than half of the surface). Only nodes count that a fitted photo shows
    too: of others, the photos say nothing. With fewer than MIN_PHOTOS it is the first.
    """
    photos = np.unique(seen.photo)
    first, even = candidates[0]
    if len(photos) < MIN_PHOTOS:
        return MaterialVariation(first)
    held = yield from _held_out([(nodes, *each) for each in candidates], even, seen)
    found = {kind: one for (kind, _), one in zip(candidates, held, strict=True)}
    if len(found[first].cost) < MIN_PHOTOS:
        return MaterialVariation(first)
    chosen = first
    for kind, _ in candidates[1:]:
        errors = STANDARD_ERRORS if chosen == first else FURTHER_STANDARD_ERRORS
        if found[kind].better(found[chosen], chosen == EVEN, highlights, errors):
            chosen = kind
    return MaterialVariation(
        chosen,
        {kind: float(np.mean(one.cost)) for kind, one in found.items()},
        {kind: float(np.mean(one.typical)) for kind, one in found.items()},
    )


def varies_within(
    edge: float, model: NodeModel, seen: Observations, nodes: Nodes, kind: str
) -> Generator[float, None, bool]:
    """Whether a material varies within cells of the surface, by cross-validation over photos;
    yields the fraction done. A wrong light or a veil looks like a reflectance that varies slowly,
    not like texture. edge: of the cells, scan units; kind: of VARIATIONS, that varies."""
    if len(np.unique(seen.photo)) < MIN_PHOTOS:
        return False
    scales = replace(nodes, spacing=max(edge, nodes.spacing)), nodes
    coarse, fine = yield from _held_out([(some, kind, model) for some in scales], model, seen)
    return len(fine.cost) >= MIN_PHOTOS and fine.better(coarse, even=True, highlights=False)


def _held_out(
    candidates: Sequence[tuple[Nodes, str, NodeModel]], even: NodeModel, seen: Observations
) -> Generator[float, None, list[HeldOut]]:
    """The errors of held-out photos with each candidate; yields the fraction done. candidates:
    (the nodes, at some spacing; what varies; model); even: of the material without variation."""
    nodes, black = candidates[0][0], near_black(seen)
    error = error_without_variation(even, seen, nodes, black)
    found = [HeldOut() for _ in candidates]
    folds = folds_of(seen.photo)
    done, total = 0, len(folds) * len(candidates)
    for fold in folds:
        fitted, held, _ = divided_photos(seen, fold, nodes)
        for (some, kind, model), errors in zip(candidates, found, strict=True):
            theta = some.estimate(model, fitted, kind)
            errors.add_photos(held, error, log_errors(model, held, nodes, theta, black))
            done += 1
            yield done / total
    return found


def folds_of(photo: NDArray[np.integer]) -> list[NDArray[np.integer]]:
    """The photos of observations (m,) in groups, each to be held out once."""
    photos = np.unique(photo)
    count = len(photos) if len(photos) <= MAX_SINGLE_PHOTOS else FOLDS
    return [photos[k::count] for k in range(count)]


def divided_photos(
    seen: Observations, fold: NDArray[np.integer], nodes: Nodes
) -> tuple[Observations, Observations, NDArray[np.bool_]]:
    """(the observations in photos that are not in ``fold``, those in the photos of ``fold`` at
    nodes that the others show too, (n,) these nodes)."""
    out = np.isin(seen.photo, fold)
    fitted = seen.select(~out)
    shown = np.zeros(len(nodes.points), bool)
    shown[fitted.node] = True
    return fitted, seen.select(out & shown[seen.node]), shown


def error_without_variation(
    model: NodeModel, seen: Observations, nodes: Nodes, black: float
) -> float:
    """Standard deviation of the logarithm of the radiance from that of the even material."""
    zero = np.zeros((len(nodes.points), COUNT), np.float32)
    residual, _, _ = log_errors(model, seen, nodes, zero, black)
    return max(robust_deviation(residual), MIN_ERROR)


@dataclass(frozen=True)
class HeldOut:
    """Errors of held-out photos, one number each. cost: nats a pixel; typical: median relative
    error; absolute: mean absolute error of the logarithm; rms: relative RMS."""

    cost: list[float] = field(default_factory=list)
    typical: list[float] = field(default_factory=list)
    absolute: list[float] = field(default_factory=list)
    rms: list[float] = field(default_factory=list)

    def add_photos(
        self, held: Observations, error: float, errors: tuple[NDArray[np.floating], ...]
    ) -> None:
        """Append the errors of each photo of held-out observations, as of ``log_errors``."""
        for photo in np.unique(held.photo):
            own = held.photo == photo
            self._add(held.radiance[own], error, *(e[own] for e in errors))

    def _add(
        self,
        radiance: NDArray[np.floating],
        error: float,
        log: NDArray[np.floating],
        relative: NDArray[np.floating],
        difference: NDArray[np.floating],
    ) -> None:
        """Append the errors of one photo; error: standard deviation of the logarithm."""
        self.cost.append(float(robust_cost(log / error).mean()))
        self.typical.append(float(np.median(relative)))
        self.absolute.append(float(np.abs(log).mean()))
        square = np.square(difference).mean() / np.square(radiance).mean()
        self.rms.append(float(np.sqrt(square)) + MIN_ERROR)

    def better(
        self, simpler: HeldOut, even: bool, highlights: bool, errors: float = STANDARD_ERRORS
    ) -> bool:
        """Whether these errors justify more variation than those of a simpler kind; see choose.
        errors: standard errors by which the cost must be lower."""
        gain = np.log(simpler.cost) - np.log(self.cost)  # one photo with a large gain has no veto
        if gain.mean() <= errors * gain.std(ddof=1) / np.sqrt(len(gain)):
            return False
        before, after = float(np.mean(simpler.absolute)), float(np.mean(self.absolute))
        growth = float(np.exp(np.mean(np.log(self.rms)) - np.mean(np.log(simpler.rms))))
        if highlights and growth * after > before:
            return False
        if even and before**2 - after**2 <= MIN_VARIATION**2:
            return False
        return after < (1 - MIN_GAIN if even else 1) * before


def log_errors(
    model: NodeModel,
    seen: Observations,
    nodes: Nodes,
    theta: NDArray[np.float32],
    black: float,
) -> tuple[NDArray[np.floating], NDArray[np.floating], NDArray[np.floating]]:
    """(measured minus predicted logarithm of the radiance, relative error, error of the radiance),
    each (m, 3), 0 where a channel is clipped and predicted to be."""
    log, relative, error = np.empty((3, len(seen), 3), np.float32)
    for begin in range(0, len(seen), CHUNK):
        part = slice(begin, begin + CHUNK)
        some = seen.select(part)
        predicted = model.radiance(some.shading, nodes.normals[some.node], theta[some.node])
        measured = np.maximum(some.radiance, 0)
        predicted = np.where(some.clipped, np.minimum(predicted, measured), predicted)
        log[part] = np.log(measured + black) - np.log(predicted + black)
        error[part] = predicted - measured
        relative[part] = np.abs(error[part]) / np.maximum(measured, black)
    return log, relative, error
