"""The variation of a surface at the vertices of its mesh, as values of a colour scale."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from ..varying.node_model import DIFFUSE, GLOSS, SPECULAR, TILT
from ..varying.varying_surface import VaryingSurface

FULL_FACTOR, FULL_ROUGHNESS = 2.0, 1.5  # factors with the full colour
FULL_TILT = 10.0  # degrees
FULL_ERROR = 0.5  # relative standard error


@dataclass(frozen=True)
class SurfaceQuantity:
    """title: of the legend; ends: labels of the left end, the middle and the right end of the
    scale. signed: the scale goes from −1 to 1, else from 0 to 1. parameters: of the nodes
    (node_model.py), of which one has to vary. of: the surface → (n,) values at its nodes."""

    title: str
    ends: tuple[str, str, str]
    signed: bool
    parameters: tuple[int, ...]
    of: Callable[[VaryingSurface], NDArray[np.floating]]


def _factor(columns: slice | int, full: float) -> Callable[[VaryingSurface], NDArray[np.floating]]:
    """Logarithms of a factor in units of that with the full colour."""
    return lambda surface: (
        surface.parameters[:, columns].reshape(len(surface.parameters), -1).mean(axis=1)
        / np.log(full)
    )


def _tilt(surface: VaryingSurface) -> NDArray[np.floating]:
    length = np.linalg.norm(surface.parameters[:, TILT], axis=1)
    return np.degrees(np.arctan(length)) / FULL_TILT


def _error(surface: VaryingSurface) -> NDArray[np.floating]:
    squares = np.square(surface.deviation[:, DIFFUSE]).mean(axis=1)
    return np.expm1(np.sqrt(squares)) / FULL_ERROR


HALF = ("half", "typical", "twice")
QUANTITIES: Mapping[str, SurfaceQuantity] = {
    "diffuse": SurfaceQuantity(
        "Diffuse colour, relative to the typical material", HALF, True,
        (0, 1, 2), _factor(DIFFUSE, FULL_FACTOR),
    ),
    "specular": SurfaceQuantity(
        "Specular part, relative to the typical material", HALF, True,
        (SPECULAR,), _factor(SPECULAR, FULL_FACTOR),
    ),
    "roughness": SurfaceQuantity(
        "Roughness, relative to the typical material", ("÷ 1.5", "typical", "× 1.5"), True,
        (GLOSS,), _factor(GLOSS, FULL_ROUGHNESS),
    ),
    "normal": SurfaceQuantity(
        "Tilt of the normal against the mesh", ("0°", "5°", "10°"), False, (5, 6, 7), _tilt
    ),
    "error": SurfaceQuantity(
        "Standard error of the diffuse colour", ("0 %", "25 %", "50 %"), False, (0, 1, 2), _error
    ),
}  # fmt: skip
"""Kind of view → what it shows."""


def shown_quantities(surface: VaryingSurface) -> list[str]:
    """The kinds of view that show anything of a surface."""
    vary = set(np.flatnonzero(surface.parameters.any(axis=0)).tolist())
    return [kind for kind, one in QUANTITIES.items() if vary.intersection(one.parameters)]


def at_vertices(surface: VaryingSurface) -> dict[str, NDArray[np.float32]]:
    """Kind of view that shows anything → (v,) values of its scale, clipped to it: means over the
    nodes around each vertex that photos show; NaN where there are none."""
    grid = surface.grid
    face, second, third = grid.places
    rows = np.flatnonzero((surface.photos > 0) & (face >= 0))
    weights = np.stack([1 - second[rows] - third[rows], second[rows], third[rows]], axis=1)
    vertex = grid.mesh.faces[face[rows], weights.argmax(axis=1)]
    count = len(grid.mesh.vertices)
    seen = np.bincount(vertex, minlength=count)
    found = {}
    for kind in shown_quantities(surface):
        total = np.bincount(vertex, QUANTITIES[kind].of(surface)[rows], minlength=count)
        mean = np.where(seen > 0, total / np.maximum(seen, 1), np.nan)
        low = -1.0 if QUANTITIES[kind].signed else 0.0
        found[kind] = np.clip(mean, low, 1.0).astype(np.float32)
    return found
