"""Kinds of material on one surface, separated without masks.

One BRDF whose parts vary from node to node shows where the material changes: on a metal the
specular part is large against the diffuse one, on varnish the roughness is small. A parameter whose
values over the surface form two separate groups (Ashman, Bird and Zepf 1994: their means differ by
more than twice their standard deviation, and with a gap between them) separates two kinds of material. Each kind is examined
again in the same way.
"""

from __future__ import annotations

from collections.abc import Generator, Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray
from scipy.ndimage import gaussian_filter1d
from scipy.spatial import cKDTree

from .choice import HeldOut, Nodes, folds_of, log_errors
from .hierarchy import MIN_ERROR, near_black, robust_deviation
from .node_model import COUNT, DIFFUSE, GLOSS, SPECULAR, NodeModel
from .observations import Observations
from .varying_surface import VARIATIONS

Array = NDArray[np.floating]

MAX_KINDS = 4
MIN_DISTANCE = 2.0  # of the means of two groups, in their standard deviations (Ashman et al. 1994)
MIN_DIFFERENCE = np.array([0.7, 0.2])
"""Of the means of two groups: a factor of two of the ratio of specular and diffuse part, and a fifth
of the roughness. Variation within one kind describes smaller differences."""
MAX_VALLEY = 0.8
"""Of the frequency between two groups, as a part of that at the smaller one's peak."""
VALLEY_BINS, VALLEY_SMOOTHING = 100, 2.5  # of the histogram, and standard deviation in bins
VALLEY_RANGE = (0.1, 99.9)  # percentiles of the values
MIN_SHARE = 0.05  # of the nodes in the smaller group
NEIGHBOURS = 7  # nodes whose values are averaged: single ones are noisy
MIXTURE_ROUNDS = 100  # of expectation–maximisation
START_PERCENTILES = (20, 80)  # of the values, where the two means start
EVERYTHING = tuple(VARIATIONS)[-1]


@dataclass(frozen=True)
class Separation:
    """One division of a group in two. group: the number of the group that is divided; feature: the
    column of ``features`` (0 ratio of specular and diffuse part, 1 roughness); threshold: nodes
    above it form the new group."""

    group: int
    feature: int
    threshold: float


def features(model: NodeModel, points: NDArray[np.float64], parameters: Array) -> Array:
    """(n, 2) logarithms of the ratio of specular and diffuse part (0 where the model has no
    diffuse part) and of the roughness, averaged over neighbours. points: (n, 3) of the nodes;
    parameters: (n, 8)."""
    ratio = parameters[:, SPECULAR] - parameters[:, DIFFUSE].mean(axis=1)
    if not model.has_body:
        ratio = np.zeros_like(ratio)
    each = np.stack([ratio, parameters[:, GLOSS]], axis=1)
    near = cKDTree(points).query(points, k=min(NEIGHBOURS, len(points)))[1]
    averaged: Array = each[near.reshape(len(points), -1)].mean(axis=1)
    return averaged


def separate(values: Array) -> list[Separation]:
    """The divisions that nodes with ``features`` (n, 2) show, none for one kind of material."""
    found = list[Separation]()
    group = np.zeros(len(values), np.intp)
    waiting = [0]
    while waiting and len(found) < MAX_KINDS - 1:
        number = waiting.pop(0)
        own = np.flatnonzero(group == number)
        for feature in range(values.shape[1]):
            threshold = _threshold(values[own, feature], len(values), MIN_DIFFERENCE[feature])
            if threshold is not None:
                found.append(Separation(number, feature, threshold))
                group[own[values[own, feature] > threshold]] = len(found)
                waiting += [number, len(found)]
                break
    return found


def groups(values: Array, separations: Sequence[Separation]) -> NDArray[np.intp]:
    """(n,) group of each node with ``features`` (n, 2), from 0."""
    found = np.zeros(len(values), np.intp)
    for new, one in enumerate(separations, 1):
        found[(found == one.group) & (values[:, one.feature] > one.threshold)] = new
    return found


def group_at(
    places: NDArray[np.float64], points: NDArray[np.float64], group: NDArray[np.intp]
) -> NDArray[np.intp]:
    """(m,) most frequent group among the nodes at ``points`` (n, 3) nearest to places (m, 3)."""
    near = cKDTree(points).query(places, k=min(NEIGHBOURS, len(points)))[1]
    votes = group[near.reshape(len(places), -1)]
    counts = np.stack([(votes == k).sum(axis=1) for k in range(int(group.max(initial=0)) + 1)])
    return np.argmax(counts, axis=0)


def separation_improves(
    whole: NodeModel,
    parts: Sequence[NodeModel],
    separations: Sequence[Separation],
    seen: Observations,
    nodes: Nodes,
) -> Generator[float, None, tuple[bool, float, float]]:
    """Whether separate BRDFs predict held-out photos better than one; yields the fraction done.

    whole: model of all nodes, parts: of each group. All parameters vary in both. The nodes are
    grouped again from the photos that are fitted. Returns (accepted, typical error with one BRDF,
    with several).
    """
    black = near_black(seen)
    zero = np.zeros((len(nodes.points), COUNT), np.float32)
    error = max(robust_deviation(log_errors(whole, seen, nodes, zero, black)[0]), MIN_ERROR)
    one, several = HeldOut(), HeldOut()
    folds = folds_of(seen.photo)
    for done, fold in enumerate(folds):
        out = np.isin(seen.photo, fold)
        fitted = seen.select(~out)
        shown = np.zeros(len(nodes.points), bool)
        shown[fitted.node] = True
        held = seen.select(out & shown[seen.node])
        theta = _solved(whole, fitted, nodes)
        one.add_photos(held, error, log_errors(whole, held, nodes, theta, black))
        group = groups(features(whole, nodes.points, theta), separations)
        yield (done + 0.5) / len(folds)
        errors = tuple(np.zeros((len(held), 3), np.float32) for _ in range(3))
        for number, model in enumerate(parts):
            rows = np.flatnonzero(group == number)
            some, at = _at(fitted, rows, len(group)), np.flatnonzero(group[held.node] == number)
            own = _at(held, rows, len(group))
            theta = _solved(model, some, nodes.select(rows))
            for into, found in zip(
                errors, log_errors(model, own, nodes.select(rows), theta, black), strict=True
            ):
                into[at] = found
        several.add_photos(held, error, errors)
        yield (done + 1) / len(folds)
    accepted = bool(one.cost) and several.better(one, even=False, highlights=True)
    typical = [float(np.mean(e.typical)) if e.typical else np.nan for e in (one, several)]
    return accepted, typical[0], typical[1]


def _solved(model: NodeModel, seen: Observations, nodes: Nodes) -> NDArray[np.float32]:
    """(n, 8) parameters of the nodes, all free."""
    theta = np.zeros((len(nodes.points), COUNT), np.float32)
    if len(seen):
        for _, fields in nodes.solve(model, seen, EVERYTHING):
            theta = fields.parameters
    return theta


def _at(seen: Observations, rows: NDArray[np.intp], count: int) -> Observations:
    """The observations of the nodes ``rows`` of ``count``, numbered from 0."""
    number = np.full(count, -1, np.int32)
    number[rows] = np.arange(len(rows), dtype=np.int32)
    own = seen.select(np.flatnonzero(number[seen.node] >= 0))
    return replace(own, node=number[own.node])


def _threshold(values: Array, count: int, difference: float) -> float | None:
    """The value between two separate groups of values, None where they form one group. count: of
    all nodes of the surface."""
    if len(values) < 2 * MIN_SHARE * count:
        return None
    mean = np.percentile(values, START_PERCENTILES)
    deviation = np.full(2, max(float(values.std()) / 2, 1e-6))
    share = np.full(2, 0.5)
    part = np.empty((len(values), 2))
    for _ in range(MIXTURE_ROUNDS):
        part = share * np.exp(-0.5 * ((values[:, None] - mean) / deviation) ** 2) / deviation
        part /= np.maximum(part.sum(axis=1, keepdims=True), 1e-300)
        total = np.maximum(part.sum(axis=0), 1e-9)
        mean = part.T @ values / total
        square = (part * (values[:, None] - mean) ** 2).sum(axis=0) / total
        deviation, share = np.sqrt(square) + 1e-3, total / len(values)
    low, high = np.argsort(mean)
    distance = (mean[high] - mean[low]) / np.sqrt(np.mean(deviation**2))
    if distance < MIN_DISTANCE or mean[high] - mean[low] < difference:
        return None
    between = np.linspace(mean[low], mean[high], 201)
    height = np.log(share) - np.log(deviation) - 0.5 * ((between[:, None] - mean) / deviation) ** 2
    threshold = float(between[np.argmin(np.abs(height[:, high] - height[:, low]))])
    upper = float(np.count_nonzero(values > threshold))
    if min(upper, len(values) - upper) < MIN_SHARE * count:
        return None
    return threshold if _valley(values, threshold) < MAX_VALLEY else None


def _valley(values: Array, threshold: float) -> float:
    """The least frequency of values between the most frequent ones below and above a threshold, as
    a part of the smaller of the two."""
    low, high = np.percentile(values, VALLEY_RANGE)
    counts, edges = np.histogram(values, VALLEY_BINS, (low, high))
    height = gaussian_filter1d(counts.astype(float), VALLEY_SMOOTHING)
    middle = int(np.clip(np.searchsorted(edges, threshold), 1, VALLEY_BINS - 1))
    first, second = int(np.argmax(height[:middle])), middle + int(np.argmax(height[middle:]))
    return float(height[first : second + 1].min() / min(height[first], height[second]))
