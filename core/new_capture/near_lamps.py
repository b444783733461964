"""Whether the lamps of a draft are near the object, and which photos share such a lamp.

A lamp near the object lights its sides from different directions, so a distant lamp fitted to each
photo is found in a direction that differs from photo to photo. A near lamp explains them better.
"""

from __future__ import annotations

from collections.abc import Generator, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.cluster.hierarchy import fcluster, linkage
from scipy.spatial.distance import squareform

from ..concurrency.steps import scaled
from ..light import DistantLight, NearLight
from ..light_search import FoundLamp, LampPhoto, UnknownLamp, find_lamps
from .opened_scan import OpenedScan

Array = NDArray[np.float64]

MAX_NEAR_COST = 0.9  # of near lamps ÷ of distant ones, from which the lamps are near. Simulated
# captures of one to three extents of the object: 0.43 to 0.98; of distant lamps: 0.97 to 1.25
MAX_ANGLE = 12.0  # degrees between two photos of one lamp: mean of the distance between the
# directions of a distant lamp (up to 17°) and of a near one, as seen from the object (up to 7°)
MAX_JOINED_ANGLE, MAX_JOINED_COST = 20.0, 0.95  # of two groups that are joined: degrees between
# them, and cost of one lamp for both ÷ of a lamp for each photo
JOINED_SHARE = 0.3  # of the time: the search of lamps of two groups


@dataclass(frozen=True)
class NearLamps:
    """groups: index of each photo's lamp; positions: (3,) of each lamp, scan frame."""

    groups: list[int]
    positions: list[Array]


def near_lamps(
    parts: Sequence[LampPhoto],
    distant: Sequence[FoundLamp],
    groups: list[int] | None,
    centre: Array,
    opened: OpenedScan,
) -> Generator[float, None, NearLamps | None]:
    """Near lamps, None if distant ones explain the photos about as well; yields the fraction done.

    parts: pixels of each photo; distant: the distant lamp found for each; groups: index of each
    photo's lamp where it is known. centre: (3,) of the object, scan frame.
    """
    share = 1.0 if groups is not None else 1.0 - JOINED_SHARE
    near = yield from scaled(_search([[k] for k in range(len(parts))], parts, opened), 0.0, share)
    if _cost(near) > MAX_NEAR_COST * _cost(distant):
        return None
    positions = np.array([_position(one) for one in near])
    if groups is None:
        towards = positions - centre
        near_angle = _angles(towards / np.linalg.norm(towards, axis=1, keepdims=True))
        angle = 0.5 * (near_angle + _angles(np.array([direction_of(one) for one in distant])))
        steps = _grouped(angle, [one.cost for one in near], parts, opened)
        groups = yield from scaled(steps, share, 1.0)
    index = np.array(groups)
    return NearLamps(groups, [positions[index == k].mean(axis=0) for k in range(max(groups) + 1)])


def _grouped(
    angle: Array, costs: Sequence[float], parts: Sequence[LampPhoto], opened: OpenedScan
) -> Generator[float, None, list[int]]:
    """Index of each photo's lamp: photos in similar directions share one, and so do two groups
    that one lamp explains better than a lamp for each photo.

    angle: (n, n) degrees between the lamps of the photos; costs: of the near lamp of each photo.
    """
    tree = linkage(squareform(angle, checks=False), "complete")
    small, large = (fcluster(tree, t, "distance") for t in (MAX_ANGLE, MAX_JOINED_ANGLE))
    trial = [np.flatnonzero(large == k).tolist() for k in range(1, large.max() + 1)]
    joined = [len(set(small[own])) > 1 for own in trial]
    label = small.tolist()
    if any(joined):
        found = yield from _search(trial, parts, opened)
        for own, several, lamp in zip(trial, joined, found, strict=True):
            if several and lamp.cost <= MAX_JOINED_COST * np.mean([costs[i] for i in own]):
                for i in own:
                    label[i] = label[own[0]]
    order = list(dict.fromkeys(label))
    return [order.index(k) for k in label]


def _angles(directions: Array) -> Array:
    """(n, n) degrees between unit vectors (n, 3)."""
    angle = np.degrees(np.arccos(np.clip(directions @ directions.T, -1.0, 1.0)))
    np.fill_diagonal(angle, 0.0)
    return np.asarray(angle)


def _search(
    groups: Sequence[Sequence[int]], parts: Sequence[LampPhoto], opened: OpenedScan
) -> Generator[float, None, list[FoundLamp]]:
    """The near lamp of each group of photos, all together."""
    lamps = [
        UnknownLamp(NearLight(f"{k}", np.zeros(3)), tuple(parts[i] for i in own))
        for k, own in enumerate(groups)
    ]
    found = yield from find_lamps(lamps, 1, opened.rays, opened.dictionary, with_errors=False)
    return [one for one in found.lamps if one is not None]


def _cost(lamps: Sequence[FoundLamp]) -> float:
    return float(np.sum([one.cost for one in lamps]))


def direction_of(lamp: FoundLamp) -> Array:
    """(3,) of a lamp that was searched as a distant one."""
    assert isinstance(lamp.light, DistantLight)
    return lamp.light.direction


def _position(lamp: FoundLamp) -> Array:
    assert isinstance(lamp.light, NearLight)  # as it was searched
    return lamp.light.position
