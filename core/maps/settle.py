"""From what photos say of single texels to whole maps: each texel leans on the surface around it as
far as its own photos are unsure."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from ..scan import Mesh
from .gather import Gathered
from .level import MaterialLevel
from .surround import VertexScales
from .texels import Texels

VARIES = 0.2  # standard deviation of a texel's scale about that of its surroundings
GLOSS_VARIES = 0.15  # likewise of ln α
GLOSS_HOME = 0.05  # how soon gloss falls back to the fitted one where no highlight was seen
CHUNK = 1 << 18
FEW_VOTES = 1e-3


@dataclass(frozen=True)
class MaterialMaps:
    """One material at n texels. scale: (n, 3) of its body; gloss: (n,) ln of the factor of α;
    share: (n,) 0 … 1 how much the surface is of it."""

    scale: NDArray[np.float32]
    gloss: NDArray[np.float32]
    share: NDArray[np.float32]


@dataclass(frozen=True)
class TexelMaps:
    """materials: in the capture's order. photos: (n,) how many see the texel lit; error: (n,)
    relative standard error of its scale; material: (n,) the one with the largest share; highlight:
    (n,) whether its gloss was measured."""

    materials: tuple[MaterialMaps, ...]
    photos: NDArray[np.uint16]
    error: NDArray[np.float32]
    material: NDArray[np.uint8]
    highlight: NDArray[np.bool_]


def settle(
    mesh: Mesh, texels: Texels, gathered: Gathered, levels: tuple[MaterialLevel, ...]
) -> TexelMaps:
    """The maps of all materials."""
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
        around = body.carried(mesh, 1.0, trust=levels[index].trust)
        around_gloss = gloss.carried(mesh, 0.0, GLOSS_HOME)
        scale, shine = np.empty((n, 3), np.float32), np.empty(n, np.float32)
        for rows in _chunks(np.arange(n)):
            said = own[rows]
            weight = np.where(said, scales.weight[rows], 0.0)
            prior = texels.blend(mesh, around, rows)
            heard = np.where(said[:, None], scales.scale[rows], 0.0)
            each = weight[:, None] * levels[index].trust
            scale[rows] = (each * heard + VARIES**-2 * prior) / (each + VARIES**-2)
            total = weight + VARIES**-2
            level = np.maximum(scale[rows] @ levels[index].channels, 1e-3)
            error[rows] = np.where(material[rows] == index, 1 / np.sqrt(total) / level, error[rows])
            certain = np.where(said, scales.gloss_error[rows], np.inf) ** -2.0
            near = texels.blend(mesh, around_gloss, rows)[:, 0]
            total = certain + GLOSS_VARIES**-2
            shine[rows] = (certain * scales.gloss[rows] + GLOSS_VARIES**-2 * near) / total
        made.append(MaterialMaps(scale, shine, share[:, index].astype(np.float32)))
    return TexelMaps(tuple(made), gathered.photos, error, material, np.isfinite(scales.gloss_error))


def _shares(mesh: Mesh, texels: Texels, votes: NDArray[np.float32]) -> NDArray[np.float32]:
    """(n, materials) votes as shares; where nobody looked, as the surface around."""
    n, count = votes.shape
    if count == 1:
        return np.ones((n, 1), np.float32)
    total = votes.sum(axis=1)
    around = VertexScales.empty(len(mesh.vertices), count)
    for rows in _chunks(np.flatnonzero(total > FEW_VOTES)):
        around.add(mesh, texels, rows, votes[rows] / total[rows, None], np.full(len(rows), 1e3))
    carried = np.maximum(around.carried(mesh, 1.0 / count), 0.0)
    out = np.empty((n, count), np.float32)
    for rows in _chunks(np.arange(n)):
        near = texels.blend(mesh, carried, rows)
        near /= np.maximum(near.sum(axis=1, keepdims=True), 1e-12)
        own = total[rows, None]
        out[rows] = np.where(own > FEW_VOTES, votes[rows] / np.maximum(own, 1e-12), near)
    return out


def _chunks(rows: NDArray[np.intp]) -> list[NDArray[np.intp]]:
    return [rows[i : i + CHUNK] for i in range(0, len(rows), CHUNK)]
