"""What a pixel's own extent does: it shows a piece of surface whose normal turns."""

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

AT = 0.5 / np.sqrt(3)  # of a pixel: Gauss's two points
CORNERS = ((-AT, -AT), (AT, AT), (-AT, AT), (AT, -AT))
LEAST = np.radians(0.15)  # turn of the normal over a pixel
NEAR = np.radians(15.0)  # θh: beyond, no BRDF changes over so small a turn


@dataclass(frozen=True)
class Footprint:
    """Of the pixels of a diagnosis; what does not depend on any number is kept."""

    pixels: Pixels

    @cached_property
    def wide(self) -> NDArray[np.intp]:
        """Places of the pixels over which the highlight changes, or a part of which is turned away
        from the light."""
        turn = np.linalg.norm(self.pixels.turn, axis=2).sum(axis=1)
        state = ShadingState.of(self.pixels)
        ends = np.abs(dot(state.normal, state.light)) < turn
        return np.flatnonzero((turn > LEAST) & ((state.angles.theta_h < NEAR) | ends))

    @cached_property
    def part(self) -> Pixels:
        """These pixels."""
        return self.pixels.select(self.wide)

    def mean(self, state: ShadingState, of: Callable[[ShadingState], Array]) -> Array:
        """(w, 3) means over the corners of each wide pixel."""
        part = state.select(self.wide, self.part)
        return np.asarray(sum(of(at_corner(part, k)) for k in range(len(CORNERS))) / len(CORNERS))

    @cached_property
    def rows(self) -> dict[int, Array]:
        """Rows of a basis at the directions that the capture says, by the number of columns."""
        return {}

    def capture_rows(self, brdfs: MaterialBRDFs, state: ShadingState) -> Array:
        """BRDFs.rows of a situation in which no direction is another one than the capture says."""
        count = brdfs.coefficients.shape[2]
        if count not in self.rows:
            self.rows[count] = brdfs.rows(state.angles)
        return self.rows[count]


def at_corner(state: ShadingState, corner: int) -> ShadingState:
    """With the normals at one corner of the pixels."""
    right, down = CORNERS[corner]
    turn = state.pixels.turn
    normal = state.normal + np.float32(right) * turn[:, 0] + np.float32(down) * turn[:, 1]
    normal = normal / np.linalg.norm(normal, axis=1, keepdims=True)
    return replace(state, normal=normal.astype(np.float32))
