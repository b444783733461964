"""The viewer of a fit: its object and a sphere with the measured materials, in any browser."""

from __future__ import annotations

from pathlib import Path

from ..fit.measured_result import MeasuredResult
from ..jobs import CaptureResult, MaterialResult
from ..scan.up_axis import find_up
from ..viewer.model_tables import ViewerMaterial
from ..viewer.page import FILE_NAME, has_program, write_viewer
from ..viewer.skies import computed_skies
from ..viewer.viewer_object import ViewerObject

MEAN = "The materials vary over the surface; the viewer shows their mean."


def write_viewer_of(folder: Path, result: CaptureResult) -> str | None:
    """Write viewer.html into a folder; returns its name. None where the viewer's program was not
    built."""
    if not has_program():
        return None
    mesh, up = result.scan.mesh, find_up(result.scan.cameras, result.scan.mesh)
    first = result.scan.camera(result.capture.photos[0].camera)
    thing = ViewerObject.of(
        mesh.vertices,
        mesh.faces,
        result.face_material,
        None if up is None else up.direction,
        None if first is None else first.pose.centre,
    )
    notes = []
    if result.varying is not None and result.varying.varies:
        notes.append(MEAN)
    write_viewer(
        folder / FILE_NAME,
        result.capture.file.name.removesuffix(".toml").removesuffix(".capture"),
        [_material(material) for material in result.materials],
        computed_skies(),
        thing,
        notes,
    )
    return FILE_NAME


def _material(material: MaterialResult) -> ViewerMaterial:
    models = {}
    if material.portable is not None:
        models = {
            "lobes": material.lobes.stack.evaluate,
            "principled": material.principled.principled.evaluate,
        }
    fit = material.fit
    factor = fit.band.factor if isinstance(fit, MeasuredResult) else None
    return ViewerMaterial.of(material.name, fit.brdf, models, factor)
