"""The footprint of a pixel: it shows a piece of surface over which the normal changes."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from ...angles.vectors import dot
from .material_brdfs import MaterialBRDFs
from .pixels import Pixels
from .shading_state import ShadingState

Array = NDArray[np.floating]

GAUSS_POINT = 0.5 / np.sqrt(3)  # pixels from the centre: two-point Gaussian quadrature
CORNERS = (
    (-GAUSS_POINT, -GAUSS_POINT),
    (GAUSS_POINT, GAUSS_POINT),
    (-GAUSS_POINT, GAUSS_POINT),
    (GAUSS_POINT, -GAUSS_POINT),
)
MIN_TURN = np.radians(0.15)  # change of the normal over a pixel that matters
HIGHLIGHT = np.radians(15.0)  # θh beyond which BRDFs hardly change within a pixel


@dataclass(frozen=True)
class Footprint:
    """Of the pixels of a diagnosis. Values that do not depend on any parameter are cached."""

    pixels: Pixels

    @cached_property
    def wide(self) -> NDArray[np.intp]:
        """Indices of the pixels within which the highlight changes, or which are partly turned away
        from the light."""
        turn = np.linalg.norm(self.pixels.turn, axis=2).sum(axis=1)
        state = ShadingState.of(self.pixels)
        ends = np.abs(dot(state.normal, state.light)) < turn
        return np.flatnonzero((turn > MIN_TURN) & ((state.angles.theta_h < HIGHLIGHT) | ends))

    @cached_property
    def part(self) -> Pixels:
        """These pixels."""
        return self.pixels.select(self.wide)

    def mean(self, state: ShadingState, of: Callable[[ShadingState], Array]) -> Array:
        """(w, 3) means of ``of`` over the corners of each wide pixel."""
        part = state.select(self.wide, self.part)
        return np.asarray(sum(of(at_corner(part, k)) for k in range(len(CORNERS))) / len(CORNERS))

    @cached_property
    def rows(self) -> dict[int, Array]:
        """Cache: number of columns → rows of the basis at the directions of the capture."""
        return {}

    def capture_rows(self, brdfs: MaterialBRDFs, state: ShadingState) -> Array:
        """MaterialBRDFs.rows for a state whose directions are those of the capture, cached."""
        count = brdfs.coefficients.shape[2]
        if count not in self.rows:
            self.rows[count] = brdfs.rows(state.angles)
        return self.rows[count]


def at_corner(state: ShadingState, corner: int) -> ShadingState:
    """The state with the normals at one corner of each pixel."""
    right, down = CORNERS[corner]
    turn = state.pixels.turn
    normal = state.normal + np.float32(right) * turn[:, 0] + np.float32(down) * turn[:, 1]
    normal = normal / np.linalg.norm(normal, axis=1, keepdims=True)
    return replace(state, normal=normal.astype(np.float32))
