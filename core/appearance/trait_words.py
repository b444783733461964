"""What a component does to a material, in words: measured, never guessed.

Each of the first components is moved by one deviation to either side in every material of the
training set (in the mean material where the training coefficients are not known), and these are
followed, as logarithms; the median over the materials stands for the component:

- body: reflectance beside the highlight, seen and lit within 45° of the normal;
- peak: reflectance where the highlight is brightest, light and view 10° from it;
- width: the half angle at which the highlight has fallen to half its height above the body, of
  those materials alone whose highlight is more than twice as bright as their body;
- grazing: reflectance of the highlight with light and view 78° from it, against the peak.
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

SEEN = 0.1  # in a logarithm, for one deviation: less than 10 % is no word's worth
MAIN = 0.5  # a second word must be this share of the first, each against the largest of its kind
BODY_AT, PEAK_AT, GRAZING_AT = (40.0, 15.0, 90.0), (0.0, 10.0, 90.0), (0.0, 78.0, 90.0)
WIDTHS = np.geomspace(0.05, 80.0, 200)  # degrees of θh
WORDS = {
    "body": ("darker body", "brighter body"),
    "peak": ("weaker highlight", "stronger highlight"),
    "width": ("sharper highlight", "wider highlight"),
    "grazing": ("less at grazing angles", "more at grazing angles"),
}
HIGHLIGHT = " highlight"
NOTHING = "hardly visible"


@dataclass(frozen=True)
class Effect:
    """What one deviation of a component brings to the logarithm of each, see above."""

    body: float
    peak: float
    width: float
    grazing: float


def effects(basis: Basis) -> list[Effect]:
    """Of each of the components that can be moved."""
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
    """(4, materials) of ρ (directions, materials): the logarithms, NaN where there is none."""
    body, peak, grazing = np.maximum(rho[:3], mapping.EPSILON)
    above = np.maximum(rho[3:] - body, 0.0)
    fallen = above < 0.5 * above[0]
    width = np.where(above[0] > body, WIDTHS[np.argmax(fallen, axis=0)], np.nan)
    return np.log(np.stack([body, peak, width, grazing / peak]))


def words(found: list[Effect]) -> list[str]:
    """For each component what it does when it is moved up: at most two things, the main one first.

    What is main is told against the largest effect of its kind that any component has: highlights
    change by factors where bodies change by percents.
    """
    table = np.array([[getattr(e, f.name) for f in fields(Effect)] for e in found])
    largest = np.maximum(np.abs(table).max(axis=0), SEEN)
    return [_said(row, np.abs(row) / largest) for row in table]


def _said(row: Array, share: Array) -> str:
    names = [f.name for f in fields(Effect)]
    main = max((s for s, v in zip(share, row, strict=True) if abs(v) >= SEEN), default=0.0)
    order = [int(i) for i in np.argsort(-share, kind="stable")]
    chosen = [i for i in order if abs(row[i]) >= SEEN and share[i] >= MAIN * main][:2]
    told = [WORDS[names[i]][int(row[i] > 0)] for i in chosen]
    if not told:
        return NOTHING
    if len(told) == 2 and all(word.endswith(HIGHLIGHT) for word in told):
        told[0] = told[0].removesuffix(HIGHLIGHT)
    return ", ".join(told)
