"""The viewer of a fit: its object and a sphere with the measured materials, in any browser."""

from __future__ import annotations

from collections.abc import Sequence
from functools import partial
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from ..fit.measured_result import MeasuredResult
from ..jobs import CaptureResult, MaterialResult
from ..scan.up_axis import find_up
from ..varying.node_model import GLOSS, TILT, NodeModel, diffuse_factor, specular_factor
from ..varying.varying_surface import VaryingSurface
from ..viewer.model_tables import ViewerMaterial
from ..viewer.page import FILE_NAME, has_program, write_viewer
from ..viewer.photo_layers import PhotoLayers
from ..viewer.skies import computed_skies
from ..viewer.viewer_object import ViewerObject

Array = NDArray[np.floating]

VARIES = (
    "The materials vary over the object: colour, gloss and normals are those of the points of its "
    "mesh. The sphere has the typical material."
)


def write_viewer_of(
    folder: Path, result: CaptureResult, photos: Sequence[PhotoLayers] = ()
) -> None:
    """Write viewer.html into a folder where the viewer's program was built. photos: to be compared
    with their predictions."""
    if not has_program():
        return
    mesh, up = result.scan.mesh, find_up(result.scan.cameras, result.scan.mesh)
    varying = result.varying if result.varying is not None and result.varying.varies else None
    first = result.scan.camera(result.capture.photos[0].camera)
    thing = ViewerObject.of(
        mesh.vertices,
        mesh.faces,
        result.face_material,
        None if up is None or not up.reliable else up.direction,
        None if first is None else first.pose.centre,
        None if varying is None else partial(_factors, varying),
    )
    write_viewer(
        folder / FILE_NAME,
        result.capture.file.name.removesuffix(".toml").removesuffix(".capture"),
        [_material(material, varying is not None) for material in result.materials],
        computed_skies(),
        thing,
        [] if varying is None else [VARIES],
        photos,
    )


def _factors(
    surface: VaryingSurface, face: NDArray[np.integer], second: Array, third: Array
) -> NDArray[np.float32]:
    """(m, 10) Part.factors at points of faces."""
    parameters = surface.at(face, second, third)
    return np.concatenate(
        [
            diffuse_factor(parameters),
            specular_factor(parameters),
            np.exp(parameters[:, GLOSS, None]),
            parameters[:, TILT],
        ],
        axis=1,
    )


def _material(material: MaterialResult, varies: bool) -> ViewerMaterial:
    models = {}
    if material.portable is not None:
        models = {
            "lobes": material.lobes.stack.evaluate,
            "principled": material.principled.principled.evaluate,
        }
    fit = material.fit
    factor = fit.band.factor if isinstance(fit, MeasuredResult) else None
    body = None
    if varies:
        red, green, blue = NodeModel.of(fit.brdf).body.tolist()
        body = (red, green, blue)
    return ViewerMaterial.of(material.name, fit.brdf, models, factor, body)
