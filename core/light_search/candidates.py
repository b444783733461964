"""Candidate lights of a search, spread over all that is possible for the kind of a light."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from ..angles.vectors import even_directions
from ..light import DistantLight, Light, MountedLight, NearLight

Array = NDArray[np.float64]

DIRECTIONS = 600  # over the sphere: neighbours are 8° apart
NEAR_DIRECTIONS = 250  # of near lights, 13° apart
NEAR_DISTANCES = (0.8, 1.3, 2.2, 4.0)  # from the centre of the points, in units of their extent
FLASH_DISTANCES = (0.06, 0.13, 0.22, 0.33, 0.46)  # from the lens, in units of the reach
FLASH_AZIMUTHS = 12


def candidate_lights(light: Light, points: Array, reach: float) -> list[Light]:
    """Candidates of the kind of ``light``, which keep its other values.

    points: (n, 3) surface points, scan frame; reach: median distance from camera to surface, scan
    units.
    """
    if isinstance(light, DistantLight):
        return [replace(light, direction=d) for d in even_directions(DIRECTIONS)]
    if isinstance(light, MountedLight):
        return [replace(light, offset=o * reach) for o in _flash_offsets()]
    if isinstance(light, NearLight):
        centre = points.mean(axis=0)
        extent = float(np.linalg.norm(points.max(axis=0) - points.min(axis=0)))
        return [
            replace(light, position=centre + far * extent * d)
            for far in NEAR_DISTANCES
            for d in even_directions(NEAR_DIRECTIONS)
        ]
    raise TypeError(f"{type(light).__name__} cannot be searched for")


def _flash_offsets() -> list[Array]:
    """(3,) offsets right, down and forward, in units of the reach: at the lens and around it."""
    found = [np.zeros(3)]
    for ring, distance in enumerate(FLASH_DISTANCES):
        for step in range(FLASH_AZIMUTHS):
            angle = 2 * np.pi * (step + 0.5 * (ring % 2)) / FLASH_AZIMUTHS
            found.append(distance * np.array([np.cos(angle), np.sin(angle), 0.0]))
    return found
