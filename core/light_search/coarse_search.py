"""The candidates of one lamp that explain its own photos best, each with a material of its own."""

from __future__ import annotations

from collections.abc import Generator, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from ..geometry import RayScene
from ..light import Light
from .brdf_dictionary import BrdfDictionary
from .materials import own_materials
from .shading import LampPixels, predicted

KEPT_CANDIDATES = 60  # of a lamp
YIELD_INTERVAL = 20  # candidates


@dataclass(frozen=True)
class Candidate:
    """cost: of the lamp's own photos; radiance: (n, k) of the dictionary; own: (m, k) coefficients
    of the materials by these photos alone."""

    light: Light
    cost: float
    radiance: NDArray[np.float32]
    own: NDArray[np.float64]


def best_candidates(
    lights: Sequence[Light],
    pixels: LampPixels,
    materials: int,
    rays: RayScene,
    dictionary: BrdfDictionary,
) -> Generator[float, None, list[Candidate]]:
    """The best KEPT_CANDIDATES, best first; a generator that yields the fraction done."""
    found: list[Candidate] = []
    for index, light in enumerate(lights):
        if index % YIELD_INTERVAL == 0:
            yield index / len(lights)
        radiance = pixels.dictionary_radiance(light, rays, dictionary)
        own = own_materials(pixels, radiance, materials)
        cost = pixels.measured.cost(predicted(radiance, own, pixels.material))
        found.append(Candidate(light, cost, radiance, own))
        if len(found) >= 2 * KEPT_CANDIDATES:  # bounds the memory
            found = _best(found)
    return _best(found)


def _best(found: Sequence[Candidate]) -> list[Candidate]:
    return sorted(found, key=lambda one: one.cost)[:KEPT_CANDIDATES]
