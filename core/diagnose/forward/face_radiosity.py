"""Radiance that every face of the mesh emits under the lamp after all bounces."""

from __future__ import annotations

from functools import partial

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

OBLIQUE = np.radians(45.0)  # angle whose directional albedo is used for all
NEIGHBOURS = 8  # nearest pixels, whose median gives the material of a face


def face_radiosity(
    pixels: Pixels,
    brdfs: MaterialBRDFs,
    rays: RayScene,
    scale: NDArray[np.float32],
    visible: NDArray[np.int32],
    photo: int,
) -> Array:
    """(f, 3) radiance in one photo. The material of a face is that of the nearest pixels. The lamp
    is treated as distant, with the light of one of the photo's pixels. visible: (f, r) of
    radiosity.visible_faces. scale: (m,) of the samples of each material."""
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
    oblique = np.array([OBLIQUE])
    albedo = np.stack(
        [
            np.clip(directional_albedo(partial(brdfs.evaluate_one, k), oblique)[0], 0, 1)
            for k in range(len(brdfs.coefficients))
        ]
    )
    if len(albedo) == 1:
        material = np.zeros(len(centre), np.int64)
    else:
        near = cKDTree(pixels.point).query(centre, NEIGHBOURS)[1]
        material = np.round(np.median(pixels.material[near], axis=1)).astype(np.int64)
    irradiance = pixels.irradiance[one] * scale[pixels.material[one]]
    light = irradiance * np.where(dark, 0, cosine)[:, None]
    # the lamp's light is in the unit of the photos; for later bounces an albedo is a plain fraction
    factor = scale[material][:, None]
    own = np.asarray(albedo[material], np.float32)
    return bounced_radiance(own / (np.pi * factor) * light, own, visible)
