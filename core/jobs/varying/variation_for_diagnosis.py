"""How the materials of a fit vary, as the baseline of a diagnosis needs it.

The BRDFs are those of the fit: the diagnosis fits them again, and patches of the surface absorb
what the variation gets wrong in their mean. Without refits and a fine grid it takes a fraction of
the time of VaryingJob.
"""

from __future__ import annotations

from collections.abc import Generator
from dataclasses import replace

import numpy as np

from ...concurrency.job import Step
from ...diagnose.selection.baseline import ACROSS
from ...varying.node_variation import MaterialNodes, NodeVariation
from ...varying.varying_surface import ALL_VARIATIONS
from ..fit_job import CaptureResult
from .node_steps import (
    CHOICE_NODES,
    DIFFUSE_ONLY,
    chosen_kind,
    final_fields,
    is_textured,
    model_of,
)
from .surface_observations import SurfaceObservations

DIAGNOSIS_CHOICE_NODES = 20_000
"""Of a material, that the choice uses: so many that nodes on a closed surface are half as far apart
as the patches of a diagnosis are wide."""
DECIDED, CHOSEN = 0.5, 0.9
"""Fractions of the time after which it is decided whether a material varies, and what varies is
chosen."""


def variation_for_diagnosis(
    result: CaptureResult, surface: SurfaceObservations, start: float, share: float
) -> Generator[Step, None, NodeVariation | None]:
    """The variation of all materials; None where held-out photos find none that varies within the
    patches of a diagnosis: these know what varies slowly, as causes do that it imitates. surface:
    observations of a grid of CHOICE_NODES. start, share: the part of the job that this takes."""
    found = dict[int, MaterialNodes]()
    each = share / len(result.materials)
    for index, material in enumerate(result.materials):
        few, some = surface.of_material(index, material, DIAGNOSIS_CHOICE_NODES)
        if not len(few):
            continue
        model, begin = model_of(material), start + index * each
        size = float(np.ptp(some.points, axis=0).max())
        if not (yield from is_textured(size / ACROSS, model, few, some, begin, DECIDED * each)):
            continue
        candidates = [(one, model) for one in (DIFFUSE_ONLY, ALL_VARIATIONS)]
        begin, part = begin + DECIDED * each, (CHOSEN - DECIDED) * each
        kind = yield from chosen_kind(candidates, few, some, True, begin, part)
        seen, nodes = surface.of_material(index, material, CHOICE_NODES)
        step = Step("estimating the variation", begin + part)
        fields = yield from final_fields(nodes, model, seen, kind.kind, step, (1 - CHOSEN) * each)
        shown = np.zeros(len(nodes.points), bool)
        shown[seen.node] = True
        rows = np.flatnonzero(shown)
        own = replace(model, scale=1.0)  # pixels of a diagnosis have irradiance divided by it
        found[index] = MaterialNodes(nodes.select(rows), own, fields.parameters[rows])
    return NodeVariation(found) if found else None
