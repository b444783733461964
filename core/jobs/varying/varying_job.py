"""Fit a capture, and estimate how its materials vary over the surface."""

from __future__ import annotations

from collections.abc import Generator, Iterator
from dataclasses import replace

import numpy as np

from ...concurrency.background import in_background
from ...concurrency.job import Job, Step, finished
from ...varying.choice import Nodes
from ...varying.conversion import typical_samples
from ...varying.labels import check_material_count
from ...varying.node_model import COUNT
from ...varying.observations import Observations
from ...varying.rough_lobe import rough_lobe_variance
from ...varying.varying_surface import (
    ALL_VARIATIONS,
    EVEN,
    VARIATIONS,
    MaterialVariation,
    VaryingSurface,
)
from ..fit_job import CaptureResult, FitJob, MaterialResult, with_portable
from .node_steps import CHOICE_NODES, chosen_kind, final_fields, model_of
from .separate_materials import separate_materials
from .surface_observations import SurfaceObservations, observe_surface, pixel_size

MODES = ("auto", "never", "always")
_, DIFFUSE, *FURTHER = VARIATIONS
MAX_NODES = 1_000_000  # of the grid: the texels that a mesh covers in a texture of 1400 × 1400
MAX_OBSERVATIONS = 40_000_000  # nodes times photos, 60 bytes each
NODES_PER_PIXEL = 4.0  # at most: half a pixel apart, photos are interpolated without loss
REFITS = 2  # of the BRDF, without the variation found so far
FITTED, OBSERVED, SEPARATED, CHOSEN = 0.25, 0.3, 0.45, 0.75
"""Fractions of the time after which the fit is done, photos are read, materials are separated, and
what varies is chosen."""


class VaryingJob(Job):
    """Sets ``result``: the fit of ``fit`` with the variation of its materials, and with their BRDFs
    fitted again without it. It is the fit as it was where held-out photos find all materials even.
    A single material is separated into several where these predict held-out photos better.

    fit: that has not run, or that has finished. mode: "auto", or "always" for all that can vary.
    nodes: of the grid on the mesh.
    """

    def __init__(self, fit: FitJob, mode: str = "auto", nodes: int = MAX_NODES) -> None:
        super().__init__()
        self.portable, fit.portable = fit.portable, False  # of the final materials only
        self.fit, self.mode, self.nodes = fit, mode, nodes
        self.result: CaptureResult | None = None

    def run(self) -> Iterator[Step]:
        """Fit, separate materials and choose what varies on a coarse grid, then estimate it on a
        fine one."""
        check_material_count(self.fit.capture)
        if self.fit.result is None:
            for step in self.fit.run():
                yield Step(step.stage, FITTED * step.fraction)
        before = finished(self.fit.result)
        coarse = yield from observe_surface(before, CHOICE_NODES, FITTED, OBSERVED - FITTED)
        parts = yield from separate_materials(
            self.fit, coarse, CHOICE_NODES, OBSERVED, SEPARATED - OBSERVED
        )
        if parts is not None:
            self.fit, coarse = parts.fit, parts.surface
            before = finished(self.fit.result)
        materials, kinds = list(before.materials), list[MaterialVariation]()
        share = (CHOSEN - SEPARATED) / len(materials)
        for index in range(len(materials)):
            start = SEPARATED + index * share
            material, kind = yield from self._chosen(index, coarse, start, share)
            materials[index] = material
            kinds.append(kind)
        surface = None
        if parts is not None or any(kind.kind != EVEN for kind in kinds):
            surface = yield from self._surface(before, materials, kinds)
        notes = [_sentence(m.name, k) for m, k in zip(materials, kinds, strict=True)]
        if parts is not None and surface is not None:
            surface = replace(surface, separated_from=parts.separated_from)
            notes.insert(0, parts.note)
        if self.portable:
            for index, material in enumerate(materials):
                start = CHOSEN if surface is None else 0.95
                materials[index] = yield from with_portable(material, start, self.fit.threads)
        self.result = replace(
            before, materials=tuple(materials), varying=surface, notes=(*before.notes, *notes)
        )

    def _chosen(
        self, index: int, coarse: SurfaceObservations, start: float, share: float
    ) -> Generator[Step, None, tuple[MaterialResult, MaterialVariation]]:
        """(a material with its BRDF fitted without the variation, what varies)."""
        material = finished(self.fit.result).materials[index]
        seen, nodes = coarse.of_material(index, material, CHOICE_NODES)
        if not len(seen):
            return material, MaterialVariation(EVEN)
        before, model = material, model_of(material)
        if self.mode == "auto":
            candidates = [(EVEN, model), (DIFFUSE, model)]
            kind = yield from chosen_kind(candidates, seen, nodes, False, start, 0.25 * share)
            if kind.kind == EVEN:
                return material, kind
        part = 0.25 * share / REFITS
        for number in range(REFITS):
            at = start + 0.25 * share + number * part
            material = yield from self._without_variation(index, material, seen, nodes, at, part)
        if self.mode == "always":
            return material, MaterialVariation(ALL_VARIATIONS)
        again = model_of(material)
        candidates = [(EVEN, model), *((one, again) for one in (DIFFUSE, *FURTHER))]
        found = yield from chosen_kind(
            candidates, seen, nodes, True, start + 0.5 * share, 0.5 * share
        )
        return (before if found.kind == EVEN else material), found

    def _without_variation(
        self,
        index: int,
        material: MaterialResult,
        seen: Observations,
        nodes: Nodes,
        start: float,
        share: float,
    ) -> Generator[Step, None, MaterialResult]:
        """The material, fitted to samples without the variation of its diffuse colour."""
        step, model = Step("fitting without the variation", start), model_of(material)
        fields = yield from final_fields(nodes, model, seen, DIFFUSE, step, 0.0)
        table = yield from in_background(
            lambda: typical_samples(model, seen, nodes.points, nodes.normals, fields.parameters),
            step,
        )
        capture = self.fit.capture
        self.fit.capture = replace(capture, fit=replace(capture.fit, held_out=False))
        try:
            again = yield from self.fit.fit_again(
                index, table, material, start + 0.3 * share, 0.7 * share
            )
        finally:
            self.fit.capture = capture
        # its own errors would be those of samples that the variation was removed from
        return replace(again, held_out=material.held_out)

    def _surface(
        self,
        before: CaptureResult,
        materials: list[MaterialResult],
        kinds: list[MaterialVariation],
    ) -> Generator[Step, None, VaryingSurface]:
        """The variation on a fine grid."""
        pixels = NODES_PER_PIXEL * before.scan.mesh.area / pixel_size(before) ** 2
        count = int(min(self.nodes, MAX_OBSERVATIONS / len(before.capture.photos), pixels))
        fine = yield from observe_surface(before, count, CHOSEN, 0.05)
        n = len(fine.grid)
        parameters, variance = (np.zeros((n, COUNT), np.float32) for _ in range(2))
        share = (0.95 - CHOSEN - 0.05) / len(materials)
        for index, material in enumerate(materials):
            seen, nodes = fine.of_material(index, material)
            if kinds[index].kind == EVEN or not len(seen):
                continue
            step = Step("estimating the variation", CHOSEN + 0.05 + index * share)
            model = model_of(material)
            fields = yield from final_fields(nodes, model, seen, kinds[index].kind, step, share)
            rows = fine.rows(index)
            parameters[rows], variance[rows] = fields.parameters, fields.variance
            variance[rows] += rough_lobe_variance(model, fields.parameters)
        return VaryingSurface(
            fine.grid,
            parameters,
            np.sqrt(variance),
            fine.photos,
            before.face_material.astype(np.uint8),
            tuple(kinds),
        )


def _sentence(name: str, kind: MaterialVariation) -> str:
    """What was found about a material, for the user."""
    if kind.kind != EVEN:
        errors = ""
        if kind.typical:
            errors = (
                f" Held-out photos are predicted with a typical error of "
                f"{100 * kind.typical[kind.kind]:.1f} % instead of "
                f"{100 * kind.typical[EVEN]:.1f} %."
            )
        return f"{name} varies over the surface: {kind.kind}.{errors}"
    if not kind.cost:
        return f"{name} is taken as even: too few photos show it."
    return f"{name} is even: photos that were held out are not predicted better with variation."
