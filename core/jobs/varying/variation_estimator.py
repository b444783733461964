"""What varies over the materials of a fit, and their BRDFs without this variation."""

from __future__ import annotations

from collections.abc import Generator, Sequence
from dataclasses import dataclass, replace

import numpy as np

from ...concurrency.background import in_background
from ...concurrency.job import Step
from ...samples import SampleTable
from ...varying.choice import Nodes
from ...varying.conversion import sampling_step, typical_parameters, typical_samples
from ...varying.corrected_observations import ObservationCorrection
from ...varying.labels import PackedLabels
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
from ..fit_job import CaptureResult, FitJob, MaterialResult, with_portable, with_proposed_photo
from .node_steps import CHOICE_NODES, chosen_kind, final_fields, model_of
from .separate_materials import SeparatedFit
from .surface_observations import SurfaceObservations, observe_surface, pixel_size

MODES = ("auto", "never", "always")
_, DIFFUSE, *FURTHER = VARIATIONS
MAX_NODES = 1_000_000  # of the grid: the texels that a mesh covers in a texture of 1400 × 1400
MAX_OBSERVATIONS = 40_000_000  # nodes times photos, 63 bytes each
NODES_PER_PIXEL = 4.0  # at most: half a pixel apart, photos are interpolated without loss
REFITS = 2  # of the BRDF, without the variation found so far
CHOOSING = 0.6  # fraction of the time that the choice takes
READING = 0.25  # fraction of the rest in which the photos are read


@dataclass(frozen=True)
class VariationEstimator:
    """fit: finished, fits the materials again; before: its result, or that of a second fit.
    mode: "auto", or "always" for all that can vary. nodes: of the fine grid. correction: of the
    observations, for the causes that a second fit takes into account. parts: the separation of a
    single material that ``fit`` is the fit of. portable: whether the materials get portable forms.
    """

    fit: FitJob
    before: CaptureResult
    mode: str
    nodes: int = MAX_NODES
    correction: ObservationCorrection | None = None
    parts: SeparatedFit | None = None
    portable: bool = True

    def varied(
        self, coarse: SurfaceObservations, start: float, share: float
    ) -> Generator[Step, None, CaptureResult]:
        """The result with the variation of its materials; their BRDFs are those of ``before`` where
        all are even. coarse: observations on a coarse grid, corrected. start, share: the part
        of the job that this takes."""
        before, parts, end = self.before, self.parts, start + share
        materials, kinds = list(before.materials), list[MaterialVariation]()
        each = CHOOSING * share / len(materials)
        for index in range(len(materials)):
            material, kind = yield from self._chosen(index, coarse, start + index * each, each)
            materials[index] = material
            kinds.append(kind)
        surface = None
        if parts is not None or any(kind.kind != EVEN for kind in kinds):
            start, share = start + CHOOSING * share, (1 - CHOOSING) * share
            surface = yield from self._surface(materials, kinds, coarse.labels, start, share)
        notes = [_sentence(m.name, k) for m, k in zip(materials, kinds, strict=True)]
        if parts is not None and surface is not None:
            surface = replace(surface, separated_from=parts.separated_from)
            notes.insert(0, parts.note)
        for index, material in enumerate(materials if self.portable else ()):
            materials[index] = yield from with_portable(material, end, self.fit.threads)
        found = replace(
            before, materials=tuple(materials), varying=surface, notes=(*before.notes, *notes)
        )
        return found if not self.portable else (yield from with_proposed_photo(found, end))

    def _chosen(
        self, index: int, coarse: SurfaceObservations, start: float, share: float
    ) -> Generator[Step, None, tuple[MaterialResult, MaterialVariation]]:
        """(a material with its BRDF fitted without the variation, what varies)."""
        material = self.before.materials[index]
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
        exact = seen.measured()
        fields = yield from final_fields(nodes, model, exact, DIFFUSE, step, 0.0)
        clipped = seen.select(np.flatnonzero(seen.clipped.any(axis=1)))

        def converted() -> tuple[SampleTable, SampleTable | None]:
            typical = typical_parameters(exact, fields.parameters)
            step = sampling_step(len(seen))
            tables = [
                typical_samples(
                    model, some, nodes.points, nodes.normals, fields.parameters, typical, step
                )
                for some in (exact, clipped)
                if len(some)
            ]
            return tables[0], tables[1] if len(tables) > 1 else None

        table, limits = yield from in_background(converted, step)
        capture = self.fit.capture
        self.fit.capture = replace(capture, fit=replace(capture.fit, held_out=False))
        try:
            again = yield from self.fit.fit_again(
                index, table, material, start + 0.3 * share, 0.7 * share, clipped=limits
            )
        finally:
            self.fit.capture = capture
        # its own errors would be those of samples that the variation was removed from
        return replace(again, held_out=material.held_out)

    def _surface(
        self,
        materials: list[MaterialResult],
        kinds: list[MaterialVariation],
        labels: Sequence[PackedLabels],
        start: float,
        share: float,
    ) -> Generator[Step, None, VaryingSurface]:
        """The variation on a fine grid. labels: of the pixels of each photo."""
        before = self.before
        pixels = NODES_PER_PIXEL * before.scan.mesh.area / pixel_size(before) ** 2
        count = int(min(self.nodes, MAX_OBSERVATIONS / len(before.capture.photos), pixels))
        reading = READING * share
        whole = None if self.parts is None else self.parts.whole
        fine = yield from observe_surface(
            before, count, start, reading, self.correction, self.fit.threads, labels, whole
        )
        n = len(fine.grid)
        parameters, variance = (np.zeros((n, COUNT), np.float32) for _ in range(2))
        start, share = start + reading, (share - reading) / len(materials)
        for index, material in enumerate(materials):
            seen, nodes = fine.of_material(index, material)
            if kinds[index].kind == EVEN or not len(seen):
                continue
            step = Step("estimating the variation", start + index * share)
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
