"""Complete maps from the estimates of single texels: the posterior mean of each texel, with the
surface around it as the prior."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from ..scan import Mesh
from .gather import Gathered
from .level import MaterialLevel
from .surround import VertexScales
from .texels import Texels

SCALE_PRIOR = 0.2  # standard deviation of a texel's scale about that of its surroundings
GLOSS_PRIOR = 0.15  # the same for ln α
GLOSS_PULL = 0.05  # pull of ln α towards 0 (the fitted gloss), relative to a well-measured vertex
CHUNK = 1 << 18  # texels processed at once, to limit memory
MIN_VOTES = 1e-3  # sum of the votes of a texel; below, its shares come from the surroundings


@dataclass(frozen=True)
class MaterialMaps:
    """One material at n texels. scale: (n, 3) factor of its diffuse body; gloss: (n,) ln of the
    factor of α; share: (n,) 0 … 1, share of the surface that has this material; specular: (n, 3)
    factor of its specular part."""

    scale: NDArray[np.float32]
    gloss: NDArray[np.float32]
    share: NDArray[np.float32]
    specular: NDArray[np.float32]

    @property
    def has_coloured_highlights(self) -> bool:
        """Whether the channels of the specular part differ anywhere."""
        return bool((self.specular != self.specular[:, :1]).any())


@dataclass(frozen=True)
class TexelMaps:
    """Maps of n texels. materials: in the order of the capture; photos: (n,) number of photos that
    show the texel lit; error: (n,) relative standard error of the scale; material: (n,) index of
    the one with the largest share; highlight: (n,) True where the gloss was measured."""

    materials: tuple[MaterialMaps, ...]
    photos: NDArray[np.uint16]
    error: NDArray[np.float32]
    material: NDArray[np.uint8]
    highlight: NDArray[np.bool_]


def even_factor(n: int) -> NDArray[np.float32]:
    """(n, 3) ones, which take no memory."""
    return np.broadcast_to(np.float32(1), (n, 3))


def complete_maps(
    mesh: Mesh, texels: Texels, gathered: Gathered, levels: tuple[MaterialLevel, ...]
) -> TexelMaps:
    """The maps of all materials from the gathered estimates."""
    n, v = len(texels), len(mesh.vertices)
    scales = gathered.scales
    share = _shares(mesh, texels, gathered.votes)
    material = share.argmax(axis=1).astype(np.uint8)
    error = np.empty(n, np.float32)
    made = []
    for index in range(len(levels)):
        own = (gathered.material == index) & (scales.weight > 0)
        body, gloss = VertexScales.empty(v, 3), VertexScales.empty(v, 1)
        for rows in _chunks(np.flatnonzero(own)):
            body.add(mesh, texels, rows, scales.scale[rows], scales.weight[rows])
            shiny = rows[np.isfinite(scales.gloss_error[rows])]
            certain = scales.gloss_error[shiny] ** -2.0
            gloss.add(mesh, texels, shiny, scales.gloss[shiny, None], certain)
        around = body.interpolated(mesh, 1.0, trust=levels[index].trust)
        around_gloss = gloss.interpolated(mesh, 0.0, GLOSS_PULL)
        scale, shine = np.empty((n, 3), np.float32), np.empty(n, np.float32)
        for rows in _chunks(np.arange(n)):
            measured = own[rows]
            weight = np.where(measured, scales.weight[rows], 0.0)
            prior = texels.blend(mesh, around, rows)
            data = np.where(measured[:, None], scales.scale[rows], 0.0)
            each = weight[:, None] * levels[index].trust
            scale[rows] = (each * data + SCALE_PRIOR**-2 * prior) / (each + SCALE_PRIOR**-2)
            total = weight + SCALE_PRIOR**-2
            level = np.maximum(scale[rows] @ levels[index].channels, 1e-3)
            error[rows] = np.where(material[rows] == index, 1 / np.sqrt(total) / level, error[rows])
            certain = np.where(measured, scales.gloss_error[rows], np.inf) ** -2.0
            near = texels.blend(mesh, around_gloss, rows)[:, 0]
            total = certain + GLOSS_PRIOR**-2
            shine[rows] = (certain * scales.gloss[rows] + GLOSS_PRIOR**-2 * near) / total
        own_share = share[:, index].astype(np.float32)
        made.append(MaterialMaps(scale, shine, own_share, even_factor(n)))
    return TexelMaps(tuple(made), gathered.photos, error, material, np.isfinite(scales.gloss_error))


def _shares(mesh: Mesh, texels: Texels, votes: NDArray[np.float32]) -> NDArray[np.float32]:
    """(n, materials) share of each material, from the votes; texels without votes take the shares
    of the surface around them."""
    n, count = votes.shape
    if count == 1:
        return np.ones((n, 1), np.float32)
    total = votes.sum(axis=1)
    around = VertexScales.empty(len(mesh.vertices), count)
    for rows in _chunks(np.flatnonzero(total > MIN_VOTES)):
        around.add(mesh, texels, rows, votes[rows] / total[rows, None], np.full(len(rows), 1e3))
    interpolated = np.maximum(around.interpolated(mesh, 1.0 / count), 0.0)
    out = np.empty((n, count), np.float32)
    for rows in _chunks(np.arange(n)):
        near = texels.blend(mesh, interpolated, rows)
        near /= np.maximum(near.sum(axis=1, keepdims=True), 1e-12)
        own = total[rows, None]
        out[rows] = np.where(own > MIN_VOTES, votes[rows] / np.maximum(own, 1e-12), near)
    return out


def _chunks(rows: NDArray[np.intp]) -> list[NDArray[np.intp]]:
    return [rows[i : i + CHUNK] for i in range(0, len(rows), CHUNK)]
