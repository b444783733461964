"""Separate the only material of a capture into kinds, and fit each of them."""

from __future__ import annotations

from collections.abc import Generator, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from ...capture import Capture
from ...concurrency.background import in_background, steps_in_background
from ...concurrency.job import Step, finished
from ...concurrency.steps import relayed
from ...errors import PatinaError
from ...inputs.separated_materials import (
    SeparatedFaces,
    can_separate,
    separated_names,
    with_separated,
)
from ...varying.choice import MIN_PHOTOS
from ...varying.separation import divide, division_improves, features, second_at
from ...varying.varying_surface import ALL_VARIATIONS
from ..fit_job import CaptureResult, FitJob, MaterialResult
from .node_steps import model_of
from .surface_observations import SurfaceObservations

MAX_KINDS = 4  # of material on one object: more are seldom, and each takes as long as a fit
SOLVED, FITTED = 0.2, 0.7  # fractions of a trial after which kinds are found, and are fitted
FIRST = 0.6  # fraction of the time that the first trial takes
MIN_FACES = 10_000
"""Of the mesh, so that its faces are about as small as the distance of the nodes that are
divided."""


@dataclass(frozen=True)
class SeparatedFit:
    """fit: the finished fit of the separated materials; surface: the observations with them;
    whole: the capture before, with the only material that they are parts of; note: a sentence for
    the user."""

    fit: FitJob
    surface: SurfaceObservations
    whole: Capture
    note: str

    @property
    def separated_from(self) -> str:
        """The name of the material that they are parts of."""
        return self.whole.materials[0].name


@dataclass(frozen=True)
class _Trial:
    """Two kinds that held-out photos prefer to one. second: (f,) faces of the second kind; errors:
    typical errors of held-out photos with one kind, and with two."""

    fit: FitJob
    second: NDArray[np.bool_]
    errors: tuple[float, float]


def separate_materials(
    fit: FitJob, surface: SurfaceObservations, limit: int, start: float, share: float
) -> Generator[Step, None, SeparatedFit | None]:
    """Find kinds of material in the only material of a finished fit, and fit these; None where
    there is one kind, or where held-out photos are not predicted better by several.

    surface: observations of its photos. limit: nodes that are used. start, share: the part of the
    job that this takes.
    """
    before = finished(fit.result)
    material = before.materials[0]
    if not can_separate(before.capture) or len(before.scan.mesh.faces) < MIN_FACES:
        return None
    labels = np.zeros(len(before.scan.mesh.faces), np.intp)
    first = yield from _trial(fit, material, surface, labels, 0, limit, start, FIRST * share)
    if first is None:
        return None
    labels[first.second] = 1
    found = list(finished(first.fit.result).materials)
    waiting, part = [0, 1], 0.1 * share
    while waiting and len(found) < MAX_KINDS:
        index = waiting.pop(0)
        own = surface.with_materials(labels)
        trial = yield from _trial(
            fit, found[index], own, labels, index, limit, start + FIRST * share, part
        )
        if trial is not None:
            labels[trial.second] = len(found)
            found[index], other = finished(trial.fit.result).materials
            found.append(other)
            waiting += [index, len(found) - 1]
    final = first.fit
    if len(found) > 2:
        final = _fit_of(fit, before, separated_names(material.name, len(found)), labels)
        for one in final.run():
            done = FIRST + 0.1 + (0.9 - FIRST) * one.fraction
            yield Step(f"separate materials: {one.stage}", start + share * done)
    one_error, two_error = first.errors
    note = (
        f"{material.name} was separated into {len(found)} materials. With two, held-out photos are "
        f"predicted with a typical error of {100 * two_error:.1f} % instead of "
        f"{100 * one_error:.1f} %."
    )
    return SeparatedFit(final, surface.with_materials(labels), before.capture, note)


def _trial(
    fit: FitJob,
    material: MaterialResult,
    surface: SurfaceObservations,
    labels: NDArray[np.intp],
    index: int,
    limit: int,
    start: float,
    share: float,
) -> Generator[Step, None, _Trial | None]:
    """Divide one material in two, and fit both; None where held-out photos do not prefer it.
    labels: (f,) material of each face; index: of the one that is divided."""
    seen, nodes = surface.of_material(index, material, limit)
    if len(np.unique(seen.photo)) < MIN_PHOTOS:
        return None
    model = model_of(material)
    step = Step("looking for kinds of material", start)
    parameters = yield from in_background(lambda: nodes.estimate(model, seen, ALL_VARIATIONS), step)
    values = features(model, nodes.points, parameters)
    shown = np.unique(seen.node)
    division = divide(values[shown], min(limit, len(np.unique(surface.seen.node))))
    if division is None:
        return None
    before = finished(fit.result)
    mesh, own = before.scan.mesh, labels == index
    middle = mesh.vertices[mesh.faces].mean(axis=1)
    second = own & second_at(middle, nodes.points, division.second(values))
    both = np.where(own, second.astype(np.intp), -1)
    again = _fit_of(fit, before, separated_names(material.name, 2), both)
    try:
        for one in again.run():
            done = SOLVED + (FITTED - SOLVED) * one.fraction
            yield Step(f"separate materials: {one.stage}", start + share * done)
    except PatinaError:  # too few samples of one kind
        return None
    parts = [model_of(m) for m in finished(again.result).materials]
    accepted, *errors = yield from relayed(
        steps_in_background(division_improves(model, parts, division, seen, nodes)),
        lambda done: Step(
            "predicting held-out photos", start + share * (FITTED + (1 - FITTED) * done)
        ),
    )
    return _Trial(again, second, (errors[0], errors[1])) if accepted else None


def _fit_of(
    fit: FitJob, before: CaptureResult, names: Sequence[str], labels: NDArray[np.intp]
) -> FitJob:
    """The fit of separated materials. labels: (f,) material of each face, −1 for none."""
    capture, prepare = with_separated(fit.capture, names), SeparatedFaces(labels, fit.prepare)
    return FitJob(capture, before.basis, prepare, fit.threads, fit.keep, portable=False)
