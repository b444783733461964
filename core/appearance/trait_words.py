"""A short description of the effect of each component on a material, derived from the training set.

Each of the first components is moved by one standard deviation in both directions in every material
of the training set (in the mean material where the training coefficients are unknown). The
following features are compared, as logarithms; the median over the materials describes the
component:

- body: reflectance away from the highlight, seen and lit within 45° of the normal;
- peak: reflectance where the highlight is brightest, light and view at 10° from the normal;
- width: the half angle at which the highlight has fallen to half its height above the body, only of
  materials whose highlight is more than twice as bright as their body;
- grazing: reflectance of the highlight with light and view at 78°, relative to the peak.
"""

from __future__ import annotations

import warnings
from dataclasses import dataclass, fields

import numpy as np
from numpy.typing import NDArray

from ..angles import Angles
from ..basis import Basis, mapping
from .osl_atlas import traits

Array = NDArray[np.floating]

MIN_EFFECT = 0.1  # in the logarithm, for one standard deviation: smaller effects are not described
MIN_SECOND_SHARE = 0.5  # least relative effect on a second feature, compared with that on the first
# (θh, θd, φd) of the features, degrees
BODY_AT, PEAK_AT, GRAZING_AT = (40.0, 15.0, 90.0), (0.0, 10.0, 90.0), (0.0, 78.0, 90.0)
WIDTHS = np.geomspace(0.05, 80.0, 200)  # degrees of θh
WORDS = {
    "body": ("darker body", "brighter body"),
    "peak": ("weaker highlight", "stronger highlight"),
    "width": ("sharper highlight", "wider highlight"),
    "grazing": ("less at grazing angles", "more at grazing angles"),
}
HIGHLIGHT = " highlight"
NO_EFFECT = "hardly visible"
MUCH, SLIGHTLY = "much ", "slightly "  # before descriptions that several components share


@dataclass(frozen=True)
class Effect:
    """Change of the logarithm of each feature for one standard deviation of a component."""

    body: float
    peak: float
    width: float
    grazing: float


def effects(basis: Basis) -> list[Effect]:
    """The effect of each of the components that can be moved."""
    known = basis.training
    materials = np.zeros((1, basis.count)) if known is None else known
    profile = [(theta, PEAK_AT[1], PEAK_AT[2]) for theta in WIDTHS]
    angles = np.radians(np.array([BODY_AT, PEAK_AT, GRAZING_AT, *profile]))
    at = Angles(*angles.T)
    centre, rows = basis.rows(at)
    logs = centre[:, None] + rows @ materials.T.astype(np.float32)
    step = np.float32(np.sqrt(basis.coefficient_variance))
    found = []
    for i in range(traits(basis.count)):
        change = step * rows[:, i : i + 1]
        up, down = (_features(mapping.unlog_weighted(logs + s * change, mapping.cos_map(at)))
                    for s in (1, -1))  # fmt: skip
        with warnings.catch_warnings():
            warnings.simplefilter("ignore", RuntimeWarning)  # no material with a highlight
            middle = np.nanmedian((up - down) / 2, axis=1)
        found.append(Effect(*(float(v) for v in np.nan_to_num(middle))))
    return found


def _features(rho: Array) -> Array:
    """(4, materials) logarithms of the features of ρ (directions, materials), NaN where
    undefined."""
    body, peak, grazing = np.maximum(rho[:3], mapping.EPSILON)
    above = np.maximum(rho[3:] - body, 0.0)
    fallen = above < 0.5 * above[0]
    width = np.where(above[0] > body, WIDTHS[np.argmax(fallen, axis=0)], np.nan)
    return np.log(np.stack([body, peak, width, grazing / peak]))


def words(found: list[Effect]) -> list[str]:
    """For each component the effect of increasing it: at most two features, the main one first.

    Features are compared relative to the largest effect of any component on them: highlights change
    by factors where bodies change by percents.
    """
    table = np.array([[getattr(e, f.name) for f in fields(Effect)] for e in found])
    largest = np.maximum(np.abs(table).max(axis=0), MIN_EFFECT)
    described = [_description(row, np.abs(row) / largest) for row in table]
    strength = (np.abs(table) / largest).max(axis=1)
    return _distinct(described, strength)


def _distinct(described: list[str], strength: Array) -> list[str]:
    """The same descriptions, with their strength where several components have the same one.

    strength: (n,) of the effect of each component.
    """
    found = list(described)
    for phrase in {p for p in described if described.count(p) > 1 and p != NO_EFFECT}:
        places = [i for i, p in enumerate(described) if p == phrase]
        places.sort(key=lambda i: -strength[i])
        degrees = ("", SLIGHTLY) if len(places) == 2 else (MUCH, "", SLIGHTLY)
        for rank, place in enumerate(places):
            degree = degrees[min(rank, len(degrees) - 1)]
            extra = rank - len(degrees) + 2  # weaker ones are numbered
            found[place] = f"{degree}{phrase}" + (f" ({extra})" if extra > 1 else "")
    return found


def _description(row: Array, share: Array) -> str:
    """The description of one component; row: (4,) its effect, share: (4,) relative to the largest
    of any component."""
    names = [f.name for f in fields(Effect)]
    main = max((s for s, v in zip(share, row, strict=True) if abs(v) >= MIN_EFFECT), default=0.0)
    order = [int(i) for i in np.argsort(-share, kind="stable")]
    chosen = [
        i for i in order if abs(row[i]) >= MIN_EFFECT and share[i] >= MIN_SECOND_SHARE * main
    ][:2]
    phrases = [WORDS[names[i]][int(row[i] > 0)] for i in chosen]
    if not phrases:
        return NO_EFFECT
    if len(phrases) == 2 and all(word.endswith(HIGHLIGHT) for word in phrases):
        phrases[0] = phrases[0].removesuffix(HIGHLIGHT)
    return ", ".join(phrases)
