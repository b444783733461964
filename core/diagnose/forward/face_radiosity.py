"""What every face of the mesh sends off under the lamp, however often light bounced before."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray
from scipy.spatial import cKDTree

from ...appearance.energy import directional_albedo
from ...geometry import RayScene
from ...geometry.view import cast_shadow
from .material_brdfs import MaterialBRDFs
from .pixels import Pixels
from .radiosity import bounced_radiance

Array = NDArray[np.floating]

OBLIQUE = np.radians(45.0)  # the angle whose albedo stands for all
NEAREST = 8  # pixels that say what a face is made of


def face_radiosity(
    pixels: Pixels,
    brdfs: MaterialBRDFs,
    rays: RayScene,
    scale: NDArray[np.float32],
    visible: NDArray[np.int32],
    photo: int,
) -> Array:
    """(f, 3) radiance; a face's material is that of the nearest pixels, its light that of the
    photo's pixels (a distant lamp's is the same everywhere) and of other faces."""
    mesh = rays.mesh
    centre = mesh.vertices[mesh.faces].mean(axis=1)
    normal = mesh.face_normals
    one = np.flatnonzero(pixels.photo == photo)[0]
    towards = np.broadcast_to(pixels.light[one], centre.shape)
    cosine = np.maximum(normal @ pixels.light[one], 0)
    facing = np.flatnonzero(cosine > 0)
    dark = cosine <= 0
    dark[facing] = cast_shadow(
        rays, centre[facing], normal[facing].astype(np.float32), towards[facing], None
    )
    albedo = np.stack(
        [
            np.clip(directional_albedo(table.evaluate, np.array([OBLIQUE]))[0], 0, 1)
            for table in brdfs.tables
        ]
    )
    if len(albedo) == 1:
        material = np.zeros(len(centre), np.int64)
    else:
        near = cKDTree(pixels.point).query(centre, NEAREST)[1]
        material = np.round(np.median(pixels.material[near], axis=1)).astype(np.int64)
    irradiance = pixels.irradiance[one] * scale[pixels.material[one]]
    light = irradiance * np.where(dark, 0, cosine)[:, None]
    # what the lamp gives is in the photos' unit; from then on an albedo is a part of the light
    factor = scale[material][:, None]
    own = np.asarray(albedo[material], np.float32)
    return bounced_radiance(own / (np.pi * factor) * light, own, visible)
