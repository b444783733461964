"""Maps of a surface whose variation was estimated with the fit: each texel takes the parameters of
the nodes around it."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from ..scan import Mesh
from ..varying.node_model import (
    COUNT,
    DIFFUSE,
    GLOSS,
    SPECULAR,
    diffuse_factor,
    specular_factor,
    tilted,
)
from ..varying.varying_surface import VaryingSurface
from .level import MaterialLevel
from .settle import GLOSS_PRIOR, MaterialMaps, TexelMaps, even_factor
from .texels import Texels

CHUNK = 1 << 18  # texels processed at once, to limit memory


def maps_of_variation(
    texels: Texels, surface: VaryingSurface, levels: tuple[MaterialLevel, ...]
) -> TexelMaps:
    """The maps of all materials. Where another material is, a material's maps have the median of
    its own texels. levels: in the order of the materials."""
    n, count = len(texels), len(levels)
    share = _shares(texels, surface, count)
    material = share.argmax(axis=1).astype(np.uint8)
    scale, specular = np.ones((2, n, 3), np.float32)
    gloss, error = np.zeros((2, n), np.float32)
    photos, highlight = np.zeros(n, np.uint16), np.zeros(n, bool)
    channels = np.zeros((count, COUNT))  # parameters that the standard error is of
    for index, level in enumerate(levels):
        if level.split.mostly_specular:
            channels[index, SPECULAR] = 1.0
        else:
            channels[index, DIFFUSE] = level.channels
    for part in chunks(n):
        node, weight = surface.interpolation(
            texels.face[part], texels.second[part], texels.third[part]
        )
        found = np.einsum("mk,mkc->mc", weight, surface.parameters[node])
        deviation = np.einsum("mk,mkc->mc", weight, surface.deviation[node])
        scale[part], specular[part] = diffuse_factor(found), specular_factor(found)
        gloss[part] = found[:, GLOSS]
        error[part] = np.sum(deviation * channels[material[part]], axis=1)
        photos[part] = surface.photos[node].max(axis=1)
        highlight[part] = (deviation[:, GLOSS] > 0) & (deviation[:, GLOSS] < GLOSS_PRIOR)
    made = []
    for index in range(count):
        own = material == index
        if not own.any():
            even = even_factor(n)
            made.append(MaterialMaps(even, np.zeros_like(gloss), share[:, index], even))
            continue
        mine = tuple(_elsewhere_median(values, own) for values in (scale, gloss, specular))
        made.append(MaterialMaps(mine[0], mine[1], share[:, index], mine[2]))
    return TexelMaps(tuple(made), photos, error, material, highlight)


def normals_of_variation(
    mesh: Mesh, texels: Texels, surface: VaryingSurface, part: slice
) -> NDArray[np.float64]:
    """(m, 3) unit normals of the texels ``part``, scan frame."""
    parameters = surface.at(texels.face[part], texels.second[part], texels.third[part])
    return tilted(texels.normals(mesh, part), parameters).astype(np.float64)


def chunks(count: int) -> list[slice]:
    """All texels in parts of CHUNK."""
    return [slice(start, min(start + CHUNK, count)) for start in range(0, count, CHUNK)]


def _shares(texels: Texels, surface: VaryingSurface, count: int) -> NDArray[np.float32]:
    """(n, materials) share of each material: linear over faces between vertices, at which the faces
    around them count alike."""
    n, mesh = len(texels), surface.grid.mesh
    if count == 1:
        return np.ones((n, 1), np.float32)
    corners = np.repeat(surface.face_material, 3)
    votes = np.zeros((len(mesh.vertices), count), np.float32)
    np.add.at(votes, (mesh.faces.ravel(), corners), 1.0)
    votes /= np.maximum(votes.sum(axis=1, keepdims=True), 1.0)
    out = np.empty((n, count), np.float32)
    for part in chunks(n):
        out[part] = texels.blend(mesh, votes, part)
    return out


def _elsewhere_median(values: NDArray[np.float32], own: NDArray[np.bool_]) -> NDArray[np.float32]:
    """values (n, …), with the median of ``own`` rows in all others."""
    if own.all():
        return values
    shape = (-1,) + (1,) * (values.ndim - 1)
    return np.where(own.reshape(shape), values, np.median(values[own], axis=0)).astype(np.float32)
