"""Kinds of material on one surface, separated without masks.

One BRDF whose parts vary from node to node shows where the material changes: on a metal the
specular part is large against the diffuse one, on varnish the roughness is small. Such a parameter
separates two kinds of material where its values over the surface form two groups: their means
differ by more than twice their standard deviation (Ashman, Bird and Zepf 1994), and few values lie
between them. Each kind is examined again with its own BRDF.
"""

from __future__ import annotations

from collections.abc import Generator, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.ndimage import gaussian_filter1d
from scipy.spatial import cKDTree

from .choice import (
    HeldOut,
    Nodes,
    divided_photos,
    error_without_variation,
    folds_of,
    log_errors,
)
from .node_model import DIFFUSE, GLOSS, SPECULAR, NodeModel
from .observations import Observations
from .radiance_error import near_black
from .split import MIN_BODY_SHARE
from .varying_surface import ALL_VARIATIONS

Array = NDArray[np.floating]

RATIO, ROUGHNESS, SPECULAR_PART = range(3)  # columns of ``features``
MIN_DISTANCE = 2.0  # of the means of two groups, in their standard deviations (Ashman et al. 1994)
MIN_DIFFERENCE = np.array([0.7, 0.2])
"""Of the means of two groups: a factor of two of the ratio of specular and diffuse part, and a
fifth of the roughness. Variation within one kind describes smaller differences."""
MIN_SPECULAR_DIFFERENCE = 0.5
"""Of the mean logarithms of the specular part of two groups that the ratio divides: two colours of
one paint have the same one. Measured: 0.2 to 0.3 of two colours, 0.9 to 1.1 of paint and metal."""
MAX_VALLEY = 0.8
"""Of the frequency between two groups, as a part of that at the smaller one's peak."""
VALLEY_BINS, VALLEY_SMOOTHING = 100, 2.5  # of the histogram, and standard deviation in bins
VALLEY_RANGE = (0.1, 99.9)  # percentiles of the values
MIN_SHARE = 0.05  # of the nodes in the smaller group
NEIGHBOURS = 7  # nodes whose values are averaged: single ones are noisy
MIXTURE_ROUNDS = 100  # of expectation–maximisation
START_PERCENTILES = (20, 80)  # of the values, where the two means start


@dataclass(frozen=True)
class Division:
    """Of a material in two kinds. feature: column of ``features``; threshold: nodes above it are of
    the second kind."""

    feature: int
    threshold: float

    def second(self, values: Array) -> NDArray[np.bool_]:
        """(n,) whether nodes with ``features`` (n, 3) are of the second kind."""
        above: NDArray[np.bool_] = values[:, self.feature] > self.threshold
        return above


def features(model: NodeModel, points: NDArray[np.float64], parameters: Array) -> Array:
    """(n, 3) logarithms of the ratio of specular and diffuse part, of the roughness and of the
    specular part, averaged over neighbours. points: (n, 3) of the nodes; parameters: (n, 10).

    The ratio is that of the light they reflect, with MIN_BODY_SHARE of the specular part added to
    the diffuse part: less than that, as of a metal, is noise. One BRDF of metal and paint can be
    that of the metal; the diffuse part of the paint's nodes is then many times larger.
    """
    share = model.split.share
    specular = (1 - share) * np.exp(parameters[:, SPECULAR])
    diffuse = share * np.exp(parameters[:, DIFFUSE].mean(axis=1))
    ratio = np.log(specular) - np.log(diffuse + MIN_BODY_SHARE * specular)
    each = np.stack([ratio, parameters[:, GLOSS], parameters[:, SPECULAR]], axis=1)
    near = cKDTree(points).query(points, k=min(NEIGHBOURS, len(points)))[1]
    averaged: Array = each[near.reshape(len(points), -1)].mean(axis=1)
    return averaged


def divide(values: Array, count: int, by: Sequence[int] = (RATIO, ROUGHNESS)) -> Division | None:
    """The division that nodes with ``features`` (n, 3), which photos show, suggest; None for one
    kind of material. count: of all such nodes of the surface; by: features to look at."""
    for feature in by:
        threshold = _threshold(values[:, feature], count, MIN_DIFFERENCE[feature])
        if threshold is None:
            continue
        found = Division(feature, threshold)
        second = found.second(values)
        specular = values[second, SPECULAR_PART].mean() - values[~second, SPECULAR_PART].mean()
        if feature != RATIO or abs(specular) >= MIN_SPECULAR_DIFFERENCE:
            return found
    return None


def second_at(
    places: NDArray[np.float64], points: NDArray[np.float64], second: NDArray[np.bool_]
) -> NDArray[np.bool_]:
    """(m,) whether most nodes near places (m, 3) are of the second kind. points: (n, 3) of nodes;
    second: (n,) their kinds."""
    near = cKDTree(points).query(places, k=min(NEIGHBOURS, len(points)))[1]
    most: NDArray[np.bool_] = second[near.reshape(len(places), -1)].mean(axis=1) > 0.5
    return most


def division_improves(
    whole: NodeModel,
    parts: Sequence[NodeModel],
    division: Division,
    seen: Observations,
    nodes: Nodes,
) -> Generator[float, None, tuple[bool, float, float]]:
    """Whether two BRDFs predict held-out photos better than one; yields the fraction done.

    whole: model of all nodes, parts: of each kind. All parameters vary in both. The nodes are
    divided again by the photos that are fitted. Two must be better by as much as makes a surface
    uneven (choice.py), but not by standard errors: that there are two, their groups show already,
    and where few photos show the surface, those that remain divide it less well. Returns (accepted,
    typical error with one BRDF, with two).
    """
    black = near_black(seen)
    error = error_without_variation(whole, seen, nodes, black)
    one, several = HeldOut(), HeldOut()
    folds = folds_of(seen.photo)
    for done, fold in enumerate(folds):
        fitted, held, shown = divided_photos(seen, fold, nodes)
        theta = nodes.estimate(whole, fitted, ALL_VARIATIONS)
        one.add_photos(held, error, log_errors(whole, held, nodes, theta, black))
        values = features(whole, nodes.points, theta)
        again = divide(values[shown], np.count_nonzero(shown), (division.feature,)) or division
        second = again.second(values)
        yield (done + 0.5) / len(folds)
        errors = tuple(np.zeros((len(held), 3), np.float32) for _ in range(3))
        for number, model in enumerate(parts):
            rows = np.flatnonzero(second == number)
            own, at = nodes.select(rows), np.flatnonzero(second[held.node] == number)
            theta = own.estimate(model, fitted.at_nodes(rows, len(second)), ALL_VARIATIONS)
            found = log_errors(model, held.at_nodes(rows, len(second)), own, theta, black)
            for into, part in zip(errors, found, strict=True):
                into[at] = part
        several.add_photos(held, error, errors)
        yield (done + 1) / len(folds)
    accepted = bool(one.cost) and several.better(one, True, True, 0.0)
    typical = [float(np.mean(e.typical)) if e.typical else np.nan for e in (one, several)]
    return accepted, typical[0], typical[1]


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
