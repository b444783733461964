"""Standard errors of found lights: a jackknife over parts of the surface and of the dictionary.

What is wrong in a scan's normals, and in the description of its material, is alike in neighbouring
pixels, so pixels are no independent measurements. Each of GROUPS repetitions leaves out some blocks
of the surface, for all lamps, together with some of the dictionary's BRDFs, and finds lights and
materials again (delete-a-group jackknife, Kott 2001).
"""

from __future__ import annotations

from collections.abc import Generator, Sequence
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray
from scipy.stats import f as f_distribution

from ..geometry import RayScene
from ..light import DistantLight, Light, MountedLight, NearLight
from .brdf_dictionary import BrdfDictionary
from .local_search import minimised_light
from .materials import shared_materials
from .shading import LampPixels

Array = NDArray[np.float64]

GROUPS = 8
# standard errors within which 90 % of directions lie: Hotelling's T² in two dimensions
RADIUS_90 = float(np.sqrt(2 * (GROUPS - 1) / (GROUPS - 2) * f_distribution.ppf(0.9, 2, GROUPS - 2)))
BLOCKS = 5  # of the surface along its longest axis
PIXELS = 3000  # of a lamp
SCALES = (0.3, 0.12)  # of the simplex of each repetition's searches
MIN_ERROR = np.radians(0.1)  # of a direction: the resolution of the last simplex
MIN_RELATIVE_ERROR = 0.002  # of a position or an offset, in units of the reach


def standard_errors(
    lights: Sequence[Light],
    stated: Sequence[Light],
    known: Sequence[bool],
    lamps: Sequence[LampPixels],
    reach: Sequence[float],
    coefficients: Array,
    rays: RayScene,
    dictionary: BrdfDictionary,
) -> Generator[float, None, list[float]]:
    """Standard error per axis of each light, radians or scan units; yields the fraction done.

    lights: found or known ones; stated: as the search started; lamps: pixels of each; reach:
    median distance from camera to surface; coefficients: (m, k) of the materials.
    """
    rng = np.random.default_rng(0)
    block = surface_blocks(np.concatenate([lamp.points for lamp in lamps]))
    of_block = rng.permutation(int(block.max(initial=0)) + 1) % GROUPS
    of_brdf = rng.permutation(dictionary.count) % GROUPS
    ends = np.cumsum([len(lamp.material) for lamp in lamps])
    groups = np.split(of_block[block], ends[:-1])
    values = []
    for group in range(GROUPS):
        yield group / GROUPS
        kept = [lamp.select(own != group) for lamp, own in zip(lamps, groups, strict=True)]
        fewer = replace(
            dictionary, table=np.ascontiguousarray(dictionary.table[:, of_brdf != group])
        )
        found = list(lights)
        own = coefficients[:, of_brdf != group] + 1e-6  # not all 0
        for scale in (None, *SCALES):
            if scale is not None:
                for i, lamp in enumerate(kept):
                    if not known[i]:
                        found[i] = minimised_light(
                            found[i], stated[i], reach[i], lamp, own, scale, rays, fewer
                        )
            radiance = [
                lamp.dictionary_radiance(light, rays, fewer)
                for lamp, light in zip(kept, found, strict=True)
            ]
            own = shared_materials(kept, radiance, own)
        values.append([_place(light) for light in found])
    spread = np.array(values) - np.mean(values, axis=0)  # (groups, lamps, 3)
    variance = (GROUPS - 1) / GROUPS * np.square(spread).sum(axis=(0, 2))
    errors = []
    for light, total, far in zip(lights, variance, reach, strict=True):
        if isinstance(light, DistantLight):  # the third component of a direction is not free
            errors.append(max(float(np.sqrt(total / 2)), float(MIN_ERROR)))
        else:
            errors.append(max(float(np.sqrt(total / 3)), MIN_RELATIVE_ERROR * far))
    return errors


def surface_blocks(points: Array) -> NDArray[np.intp]:
    """(n,) index of the block of points (n, 3): cubes with a fifth of the longest extent."""
    low, high = np.percentile(points, [1, 99], axis=0)
    edge = max(float((high - low).max()) / BLOCKS, 1e-30)
    cell = np.clip(np.floor((points - low) / edge), 0, BLOCKS - 1).astype(np.intp)
    key = (cell[:, 0] * BLOCKS + cell[:, 1]) * BLOCKS + cell[:, 2]
    return np.asarray(np.unique(key, return_inverse=True)[1], np.intp)


def _place(light: Light) -> Array:
    """(3,) direction, position or offset."""
    if isinstance(light, DistantLight):
        return light.direction
    if isinstance(light, MountedLight):
        return light.offset
    assert isinstance(light, NearLight)
    return light.position
