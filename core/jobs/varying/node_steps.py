"""Steps on the nodes of one material, run in the background."""

from __future__ import annotations

from collections.abc import Generator

from ...concurrency.background import in_background, steps_in_background
from ...concurrency.job import Step, finished
from ...concurrency.steps import relayed
from ...varying.choice import Nodes, choose, varies_within
from ...varying.hierarchy import NodeFields
from ...varying.node_model import NodeModel
from ...varying.observations import Observations
from ...varying.varying_surface import VARIATIONS, MaterialVariation
from ..fit_job import MaterialResult

DIFFUSE_ONLY = tuple(VARIATIONS)[1]
CHOICE_NODES = 30_000  # of a material, that the choice of what varies and refits use


def model_of(material: MaterialResult) -> NodeModel:
    """The model of a material's nodes, in the unit of the photos' radiance."""
    return NodeModel.of(material.fit.brdf, material.scale)


def chosen_kind(
    candidates: list[tuple[str, NodeModel]],
    seen: Observations,
    nodes: Nodes,
    highlights: bool,
    start: float,
    share: float,
) -> Generator[Step, None, MaterialVariation]:
    """What varies; see choice.choose. start, share: the part of the job that this takes."""
    return (
        yield from relayed(
            steps_in_background(choose(candidates, seen, nodes, highlights)),
            lambda done: Step("predicting held-out photos", start + share * done),
        )
    )


def is_textured(
    edge: float, model: NodeModel, seen: Observations, nodes: Nodes, start: float, share: float
) -> Generator[Step, None, bool]:
    """Whether the colour varies within cells of the surface; see choice.varies_within."""
    return (
        yield from relayed(
            steps_in_background(varies_within(edge, model, seen, nodes, DIFFUSE_ONLY)),
            lambda done: Step("looking for texture", start + share * done),
        )
    )


def final_fields(
    nodes: Nodes, model: NodeModel, seen: Observations, kind: str, step: Step, share: float
) -> Generator[Step, None, NodeFields]:
    """The fields after the finest level. step: where the job is; share: the part of it that this
    takes."""
    steps = nodes.solve(model, seen, kind)
    fields, start = None, step.fraction
    while True:
        found = yield from in_background(lambda: next(steps, None), step)
        if found is None:
            return finished(fields)
        done, fields = found
        step = Step(step.stage, start + share * done)
