"""The surface of the simulated object: paint in changing colours, two metals, and dirt over all.

Every value is a function of the place, so that it is known at any point of the true mesh.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.floating]

WAVES = 24  # random waves that a field is the sum of
RED, CREAM = np.array([0.42, 0.05, 0.04]), np.array([0.60, 0.52, 0.36])
COPPER, STEEL = np.array([0.85, 0.50, 0.36]), np.array([0.52, 0.53, 0.55])
DIRT = np.array([0.11, 0.075, 0.05])
BORDER = 0.08  # width of the transition between materials, standard deviations of the field


@dataclass(frozen=True)
class Finish:
    """Inputs of Blender's Principled BSDF at n points. colour: (n, 3) base colour; metallic,
    roughness: (n,); kind: (n,) 0 paint, 1 copper, 2 steel, 3 dirt: the largest part."""

    colour: Array
    metallic: Array
    roughness: Array
    kind: NDArray[np.intp]


def finish_of(points: Array, seed: int = 1) -> Finish:
    """The surface at points (n, 3), scan frame."""
    size = float(np.ptp(points, axis=0).max()) if len(points) > 1 else 1.0
    place = points / size

    def field(number: int, detail: float) -> Array:
        """(n,) a smooth random field of standard deviation 1, with ``detail`` waves a size."""
        rng = np.random.default_rng((seed, number))
        way = rng.normal(size=(3, WAVES)) * 2 * np.pi * detail / np.sqrt(3)
        phase = rng.uniform(0, 2 * np.pi, WAVES)
        return np.cos(place @ way + phase).sum(axis=1) / np.sqrt(WAVES / 2)

    def above(values: Array, level: float, width: float = BORDER) -> Array:
        return np.clip((values - level) / width + 0.5, 0.0, 1.0)

    metal = above(field(0, 2.0), 0.2)
    is_steel = above(field(1, 2.5), 0.0)
    worn = above(field(3, 6.0), 0.3, 1.0)[:, None]
    paint = (1 - worn) * RED + worn * CREAM
    paint = paint * np.exp(0.15 * field(4, 20.0))[:, None]
    metals = (1 - is_steel)[:, None] * COPPER + is_steel[:, None] * STEEL
    dirt = above(field(2, 5.0), 0.8, 0.8)
    parts = np.stack(
        [(1 - metal) * (1 - dirt), metal * (1 - is_steel) * (1 - dirt),
         metal * is_steel * (1 - dirt), dirt], axis=1,
    )  # fmt: skip
    clean = (1 - metal)[:, None] * paint + metal[:, None] * metals
    rough = (1 - metal) * (0.35 + 0.04 * field(5, 4.0))
    rough = rough + metal * ((1 - is_steel) * 0.42 + is_steel * 0.32)
    return Finish(
        colour=np.clip((1 - dirt)[:, None] * clean + dirt[:, None] * DIRT, 0.0, 1.0),
        metallic=metal * (1 - dirt),
        roughness=np.clip((1 - dirt) * rough + dirt * 0.85, 0.15, 1.0),
        kind=np.argmax(parts, axis=1),
    )
