"""A fitted capture as predictions need it, from a fit in memory or from a result folder."""

from __future__ import annotations

from collections.abc import Generator
from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from ..basis import PrincipalBRDF
from ..capture import Capture
from ..concurrency.job import Step
from ..concurrency.steps import relayed
from ..geometry import RayScene
from ..inputs import capture_data
from ..inputs.lights import Lights, find_lights, refined
from ..inputs.photos import LitPhotos
from ..inputs.separated_materials import separated_scan, with_separated
from ..result import FittedResult
from ..scan import Scan
from ..varying import storage
from ..varying.node_model import NodeModel
from ..varying.varying_surface import VaryingSurface
from .displaced_lights import displaced_lights
from .face_assignment import face_materials
from .fit_job import CaptureResult
from .sampling import take_samples


@dataclass(frozen=True)
class ScaledBRDF:
    """brdf: ρ in 1/sr; where the irradiance is unknown it is too large by the factor ``scale``."""

    brdf: PrincipalBRDF
    scale: float


@dataclass(frozen=True)
class FittedScene:
    """capture: that was fitted, with its scan, photos and lights (refined where it requests that,
    and where a diagnosis found them). materials: in its order; face_material: (f,) int, index into
    them for each face. varying: how they vary over the surface, None where they are even."""

    capture: Capture
    scan: Scan
    rays: RayScene
    photos: LitPhotos
    lights: Lights
    materials: tuple[ScaledBRDF, ...]
    face_material: NDArray[np.int32]
    varying: VaryingSurface | None = None

    @cached_property
    def node_models(self) -> tuple[NodeModel, ...]:
        """The materials as the nodes of a varying surface need them."""
        return tuple(NodeModel.of(one.brdf, one.scale) for one in self.materials)

    @classmethod
    def of(cls, fitted: CaptureResult) -> FittedScene:
        """The scene of a fit in memory."""
        effects = {e.cause: dict(zip(e.names, e.numbers, strict=True)) for e in fitted.effects}
        lights = displaced_lights(fitted.lights, effects)
        return cls(
            fitted.capture, fitted.scan, fitted.rays, fitted.photos, lights,
            tuple(ScaledBRDF(m.fit.brdf, m.scale) for m in fitted.materials),
            fitted.face_material,
            fitted.varying,
        )  # fmt: skip


def scene_of_result(
    capture: Capture, result: FittedResult, threads: int | None = None
) -> Generator[Step, None, FittedScene]:
    """Open the capture of a result folder again; yields steps with the fraction done.

    capture: that was fitted. Lights are refined, and faces assigned to materials, as in the fit.
    Raises InputError, also where a material of the capture is not in the result.
    """
    stored = result.materials_of([m.name for m in capture.materials], capture.file.name)
    yield Step("reading the scan", 0.0)
    scan = capture_data.open_scan(capture)
    capture_data.check_face_attributes(capture, scan)
    capture_data.check_photos(capture, scan)
    rays, photos = RayScene.build(scan.mesh), LitPhotos.open(capture)
    lights = find_lights(capture, scan, photos)
    if any(entry.refine for entry in capture.lights):
        lights = yield from relayed(
            refined(lights, capture, scan, photos, rays, result.basis),
            lambda done: Step("refining the lights", 0.5 * done),
        )
    varying = None
    if result.varying is not None:
        varying = storage.read(result.varying, scan.mesh, len(stored))
    face_material = np.zeros(len(scan.mesh.faces), np.int32)
    if varying is not None:
        face_material = varying.face_material.astype(np.int32)
        if result.separated_from is not None:
            capture = with_separated(capture, [m.name for m in stored])
            scan = separated_scan(scan, face_material)
    elif len(capture.materials) > 1:
        taken = yield from relayed(
            take_samples(capture, scan, rays, photos, lights, threads=threads),
            lambda done: Step("assigning materials to the mesh", 0.5 + 0.5 * done),
        )
        face_material = face_materials(capture, scan, taken.votes)
    materials = tuple(ScaledBRDF(one.brdf, one.scale) for one in stored)
    lights = displaced_lights(lights, result.effects)
    return FittedScene(capture, scan, rays, photos, lights, materials, face_material, varying)
