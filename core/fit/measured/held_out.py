"""What held-out photos say: of the strength of the prior, and of the result."""

from __future__ import annotations

from collections.abc import Generator, Sequence

import numpy as np
from numpy.typing import NDArray

from .anchors import Anchors, seen_edge
from .forward import CellModel
from .lobes import fit_lobes
from .posterior import solve
from .prior import ChannelPrior

TESTED = 0.3  # share of the photos, at least: those with the most grazing light
ROUNDS = 5
ROBUST = 0.5  # log misfits beyond it are shadows and edges


def grazing_photos(model: CellModel) -> NDArray[np.int16]:
    """The photos with the largest typical θd: predicting them from the others is what unseen
    grazing directions ask of the prior. None where one is all there is."""
    photos = np.unique(model.cells.photo)
    if len(photos) < 3:
        return photos[:0]
    cells = model.cells
    typical = np.array([np.median(cells.angles.theta_d[cells.photo == p]) for p in photos])
    number = max(1, round(TESTED * len(photos)))
    return photos[np.argsort(-typical, kind="stable")[:number]]


def scores(
    model: CellModel,
    prior: ChannelPrior,
    trusts: Sequence[float],
    floor: float,
    start: NDArray[np.float64],
    together: float = 1.0,
) -> Generator[float, None, list[float]]:
    """RMS log misfit of the most grazing photos' cells for every trust in anchors, all of it found
    from the other photos alone; together: as solve() takes it. Yields the fraction done; nothing
    where no photo can be spared."""
    out = np.isin(model.cells.photo, grazing_photos(model))
    if not out.any() or out.all():
        return []
    rest, held = model.select(~out), model.select(out)
    base = solve(rest, prior, floor, start, False, ROUNDS, together)
    anchors = carried_on(rest, base.coefficients)
    found = []
    for done, trust in enumerate(trusts):
        yield done / len(trusts)
        tried = prior.anchored(anchors, trust)
        fit = solve(rest, tried, floor, base.coefficients, False, ROUNDS, together)
        level = held.predict(fit.coefficients, slopes=False).level
        misfit = np.minimum(np.abs(np.log(held.observed / level)), ROBUST)
        found.append(float(np.sqrt(np.mean(misfit**2))))
    return found


def carried_on(model: CellModel, coefficients: NDArray[np.float64]) -> Anchors:
    """Anchors beyond what a model's cells saw, from the BRDF found there."""
    edge = seen_edge(model.cells)
    return Anchors.of(fit_lobes(model.cells), model.basis, coefficients, edge)
