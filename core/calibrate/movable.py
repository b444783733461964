"""The free parameters of a light that can be refined, and the light for given values of them."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from ..angles.vectors import tangents
from ..errors import PatinaError
from ..light import DistantLight, Light, MountedLight, NearLight

Array = NDArray[np.float64]
NO_BEAM = 1e-3  # 1/beam², rad⁻²: below it (beam over 30 rad) the light has no beam


@dataclass(frozen=True)
class FreeLight:
    """A light and its free parameters. names: (k,); start, low, high: (k,) start and bounds; size:
    (k,) a typical change; light(x): the light with parameters x."""

    names: tuple[str, ...]
    start: Array
    low: Array
    high: Array
    size: Array
    light: Callable[[Array], Light]


def free_light(light: Light, reach: float) -> FreeLight:
    """The free parameters of a light. reach: median distance from camera to surface, scan units.

    A distant light: two angles (radians) from its direction. A near light: its position. A mounted
    light: its offset and 1/beam² (0: the same intensity in all directions). Raises PatinaError for
    a mounted light whose offset is more than 3 × reach.
    """
    if isinstance(light, DistantLight):
        return _direction(light)
    if isinstance(light, MountedLight) and np.linalg.norm(light.offset) > 3 * reach:
        raise PatinaError(
            f"the flash is {np.linalg.norm(light.offset):.3g} scan units from the lens, but the "
            f"surface only {reach:.3g}; expected an offset in scan units"
        )
    if isinstance(light, NearLight):
        near = light
        wide = np.full(3, 2 * reach)
        return FreeLight(
            ("x", "y", "z"), near.position, near.position - wide, near.position + wide,
            np.full(3, 0.1 * reach), lambda x: replace(near, position=x.copy()),
        )  # fmt: skip
    if isinstance(light, MountedLight):
        return _mounted(light, reach)
    raise TypeError(f"{type(light).__name__} has no parameters to refine")


def _direction(light: DistantLight) -> FreeLight:
    """Two angles from the direction of a distant light."""
    direction = light.direction
    first, second = (v[0] for v in tangents(direction[None]))

    def turned(x: Array) -> Light:
        moved = direction + np.tan(x[0]) * first + np.tan(x[1]) * second
        return replace(light, direction=moved / np.linalg.norm(moved))

    wide = np.full(2, np.radians(30.0))
    size = np.full(2, np.radians(3.0))
    return FreeLight(("angle 1", "angle 2"), np.zeros(2), -wide, wide, size, turned)


def _mounted(light: MountedLight, reach: float) -> FreeLight:
    """Offset and 1/beam² of a mounted light."""
    start = np.append(light.offset, 0.0 if light.beam is None else light.beam**-2)
    wide = 0.6 * reach

    def moved(x: Array) -> Light:
        beam = None if x[3] < NO_BEAM else float(x[3] ** -0.5)
        return replace(light, offset=x[:3].copy(), beam=beam)

    return FreeLight(
        ("right", "down", "forward", "1/beam²"), start,
        np.append(light.offset - wide, -1e-9),
        np.append(light.offset + wide, max(30.0, 4 * start[3])),
        np.array([0.1 * reach, 0.1 * reach, 0.1 * reach, 1.0]), moved,
    )  # fmt: skip
