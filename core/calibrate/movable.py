"""Which numbers of a light may be refined, and the light with other ones."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from ..angles.vectors import tangents
from ..errors import PatinaError
from ..light import DistantLight, Light, MountedLight, NearLight

Array = NDArray[np.float64]
NO_BEAM = 1e-3  # 1/beam² below this (beam over 30 rad) is no beam at all


@dataclass(frozen=True)
class Movable:
    """A light and its free numbers. names: (k,); start, low, high, size: (k,), size a typical
    change; light(x): the light with the numbers x."""

    names: tuple[str, ...]
    start: Array
    low: Array
    high: Array
    size: Array
    light: Callable[[Array], Light]


def movable(light: Light, reach: float) -> Movable:
    """The free numbers of a light. reach: median distance from camera to surface, scan units.

    A distant light: two angles (radians) away from its direction. A near one: its position. A
    mounted one: its offset and 1/beam² (0: it shines alike everywhere).
    """
    if isinstance(light, DistantLight):
        return _direction(light)
    if isinstance(light, MountedLight) and np.linalg.norm(light.offset) > 3 * reach:
        raise PatinaError(
            f"the flash is said to be {np.linalg.norm(light.offset):.3g} units from the lens, the "
            f"surface is {reach:.3g} away: expected an offset in scan units"
        )
    if isinstance(light, NearLight):
        near = light
        wide = np.full(3, 2 * reach)
        return Movable(
            ("x", "y", "z"), near.position, near.position - wide, near.position + wide,
            np.full(3, 0.1 * reach), lambda x: replace(near, position=x.copy()),
        )  # fmt: skip
    if isinstance(light, MountedLight):
        return _mounted(light, reach)
    raise TypeError(f"{type(light).__name__} has nothing to refine")


def _direction(light: DistantLight) -> Movable:
    direction = light.direction
    aside, other = (v[0] for v in tangents(direction[None]))

    def turned(x: Array) -> Light:
        moved = direction + np.tan(x[0]) * aside + np.tan(x[1]) * other
        return replace(light, direction=moved / np.linalg.norm(moved))

    wide = np.full(2, np.radians(30.0))
    size = np.full(2, np.radians(3.0))
    return Movable(("angle 1", "angle 2"), np.zeros(2), -wide, wide, size, turned)


def _mounted(light: MountedLight, reach: float) -> Movable:
    start = np.append(light.offset, 0.0 if light.beam is None else light.beam**-2)
    wide = 0.6 * reach

    def moved(x: Array) -> Light:
        beam = None if x[3] < NO_BEAM else float(x[3] ** -0.5)
        return replace(light, offset=x[:3].copy(), beam=beam)

    return Movable(
        ("right", "down", "forward", "1/beam²"), start,
        np.append(light.offset - wide, -1e-9),
        np.append(light.offset + wide, max(30.0, 4 * start[3])),
        np.array([0.1 * reach, 0.1 * reach, 0.1 * reach, 1.0]), moved,
    )  # fmt: skip
