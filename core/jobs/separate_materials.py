"""Separate the only material of a capture into kinds, and fit each of them."""

from __future__ import annotations

from collections.abc import Generator
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from ..concurrency.background import in_background, steps_in_background
from ..concurrency.job import Step, finished
from ..concurrency.steps import relayed
from ..errors import PatinaError
from ..inputs.separated_materials import (
    can_separate,
    separated_names,
    separated_scan,
    with_separated,
)
from ..scan import Scan
from ..varying.choice import MIN_PHOTOS
from ..varying.node_model import NodeModel
from ..varying.separation import (
    EVERYTHING,
    features,
    group_at,
    groups,
    separate,
    separation_improves,
)
from .fit_job import CaptureResult, FitJob
from .surface_observations import SurfaceObservations

SOLVED, FITTED = 0.2, 0.7  # fractions of the time after which kinds are found, and are fitted
MIN_FACES = 10_000
"""Of the mesh, so that its faces are about as small as the distance of the nodes that are
grouped."""


@dataclass(frozen=True)
class SeparatedFit:
    """fit: the finished fit of the separated materials; surface: the observations with them;
    separated_from: name of the material that they are parts of; note: a sentence for the user."""

    fit: FitJob
    surface: SurfaceObservations
    separated_from: str
    note: str


def separate_materials(
    fit: FitJob, surface: SurfaceObservations, limit: int, start: float, share: float
) -> Generator[Step, None, SeparatedFit | None]:
    """Find kinds of material in the only material of a finished fit, and fit these; None where
    there is one kind, or where held-out photos are not predicted better by several.

    surface: observations of its photos. limit: nodes that are used. start, share: the part of the
    job that this takes.
    """
    before = finished(fit.result)
    mesh, capture = before.scan.mesh, before.capture
    if not can_separate(capture) or len(mesh.faces) < MIN_FACES:
        return None
    material = before.materials[0]
    seen, nodes = surface.of_material(0, material, limit)
    if len(np.unique(seen.photo)) < MIN_PHOTOS:
        return None
    model = NodeModel.of(material.fit.brdf, material.scale)
    step = Step("looking for kinds of material", start)
    *_, (_, fields) = yield from in_background(
        lambda: list(nodes.solve(model, seen, EVERYTHING)), step
    )
    values = features(model, nodes.points, fields.parameters)
    separations = separate(values)
    if not separations:
        return None
    group = groups(values, separations)
    middle = mesh.vertices[mesh.faces].mean(axis=1)
    labels = yield from in_background(lambda: group_at(middle, nodes.points, group), step)
    names = separated_names(material.name, len(separations) + 1)
    again = _fit_of(fit, before, names, labels)
    try:
        for one in again.run():
            done = SOLVED + (FITTED - SOLVED) * one.fraction
            yield Step(f"separate materials: {one.stage}", start + share * done)
    except PatinaError:  # too few samples of one kind
        return None
    found = finished(again.result)
    parts = [NodeModel.of(m.fit.brdf, m.scale) for m in found.materials]
    accepted, one_error, several_error = yield from relayed(
        steps_in_background(separation_improves(model, parts, separations, seen, nodes)),
        lambda done: Step(
            "predicting held-out photos", start + share * (FITTED + (1 - FITTED) * done)
        ),
    )
    if not accepted:
        return None
    note = (
        f"{material.name} was separated into {len(names)} materials. Held-out photos are predicted "
        f"with a typical error of {100 * several_error:.1f} % instead of {100 * one_error:.1f} %."
    )
    return SeparatedFit(again, _relabelled(surface, labels), material.name, note)


def _fit_of(
    fit: FitJob, before: CaptureResult, names: tuple[str, ...], labels: NDArray[np.intp]
) -> FitJob:
    """The fit of the separated materials. labels: (f,) material of each face."""
    earlier = fit.prepare

    def prepare(scan: Scan) -> Scan:
        return separated_scan(scan if earlier is None else earlier(scan), labels)

    capture = with_separated(fit.capture, names)
    return FitJob(capture, before.basis, prepare, fit.threads, fit.keep, portable=False)


def _relabelled(surface: SurfaceObservations, labels: NDArray[np.intp]) -> SurfaceObservations:
    """The observations with the separated materials. labels: (f,) material of each face."""
    face = surface.grid.places[0]
    material = np.where(face >= 0, labels[face], -1)
    seen = replace(surface.seen, material=material[surface.seen.node].astype(np.uint8))
    return SurfaceObservations(surface.grid, material, seen)
