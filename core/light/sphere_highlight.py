"""Find the highlights on a sphere in a photo: their pixels, brightness and clipping."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy import ndimage

Array = NDArray[np.float64]

MIN_HEIGHT = 0.1  # of the brightest highlight's height above the sphere's median
MIN_SIGMA = 8.0  # height of a highlight above the median, in robust standard deviations
CUT = 0.2  # of a highlight's height: pixels above it belong to the highlight
FOOT_PIXELS = 2  # margin that is added to a single highlight
CLIPPED_CUT = 0.9  # the same as CUT where the height is that of the clipped plateau
PLATEAU = 0.995  # of the brightest value: all pixels of a clipped plateau are above it
MAX_HIGHLIGHTS = 12  # reported
EIGHT_NEIGHBOURS = np.ones((3, 3), bool)


@dataclass(frozen=True)
class Blob:
    """One highlight. rows, columns: (n,) its pixels. weights: (n,) of each pixel for the centroid.
    background: (3,) radiance around it. peak: (3,) radiance of its brightest pixel. clipped:
    whether the peak is at the sensor's limit."""

    rows: NDArray[np.intp]
    columns: NDArray[np.intp]
    weights: Array
    background: Array
    peak: Array
    clipped: bool


def find_highlights(
    pixels: NDArray, inside: NDArray[np.bool_], saturation: float | None = None
) -> list[Blob]:
    """The bright spots of (h, w, 3) linear radiance where ``inside`` (h, w), unordered.

    saturation: the value from which a channel is clipped; None: detected by a plateau of three or
    more equally bright pixels. Regions above a low threshold are split where they have several
    peaks above half of the region's height; each peak is then cut at a fraction of its own height.
    """
    light = np.asarray(pixels, float)
    grey = light.mean(axis=2)
    if not inside.any():
        return []
    values = grey[inside]
    level = float(np.median(values))
    spread = 1.4826 * float(np.median(np.abs(values - level)))
    top = float(values.max())
    if not top > level:
        return []
    limit = _limit(light, inside, saturation)
    over = (light >= limit).any(axis=2) & inside
    low = level + max(MIN_HEIGHT * (top - level), MIN_SIGMA * spread)
    regions, count = ndimage.label((grey > low) & inside, EIGHT_NEIGHBOURS)
    blobs: list[Blob] = []
    if count == 0:
        return blobs
    boxes = ndimage.find_objects(regions)
    sums = ndimage.sum_labels(grey, regions, np.arange(1, count + 1))
    for index in np.argsort(-sums)[: 4 * MAX_HIGHLIGHTS]:
        box = _grown(boxes[index], 8, grey.shape)
        own = regions[box] == index + 1
        blobs += _split(light[box], grey[box], own, inside[box], regions[box] > 0, over[box], box)
    return blobs


def _limit(light: Array, inside: NDArray[np.bool_], saturation: float | None) -> float:
    if saturation is not None:
        return saturation
    shown = light[inside]
    top = float(shown.max())
    flat = int((shown.max(axis=1) >= PLATEAU * top).sum())
    exact = int((shown == top).any(axis=1).sum())
    return PLATEAU * top if exact >= 3 and flat >= 3 else np.inf


def _split(
    light: Array,
    grey: Array,
    own: NDArray[np.bool_],
    inside: NDArray[np.bool_],
    any_region: NDArray[np.bool_],
    over: NDArray[np.bool_],
    box: tuple[slice, slice],
) -> list[Blob]:
    ring = ndimage.binary_dilation(own, EIGHT_NEIGHBOURS, iterations=6) & inside
    ring &= ~ndimage.binary_dilation(any_region, EIGHT_NEIGHBOURS, iterations=1)
    if ring.sum() < 8:
        ring = inside & ~any_region
    around = np.median(light[ring], axis=0) if ring.any() else np.zeros(3)
    floor = float(around.mean())
    height = float(grey[own].max()) - floor
    peaks, count = ndimage.label(own & (grey - floor > 0.5 * height), EIGHT_NEIGHBOURS)
    found: list[Blob] = []
    taken = np.zeros(grey.shape, bool)
    sums = ndimage.sum_labels(grey, peaks, np.arange(1, count + 1))
    for index in np.argsort(-sums)[:MAX_HIGHLIGHTS]:
        core = (peaks == index + 1) & ~taken
        if not core.any():
            continue
        tall = float(grey[core].max()) - floor
        clipped = bool((over & core).any())
        part = CLIPPED_CUT if clipped else CUT if count == 1 else 0.5
        cut = floor + part * tall
        region = _largest(own & (grey > cut) & ~taken, core, grey - cut)
        peak = light[region][np.argmax(grey[region])]
        taken |= region | core
        if count == 1 and not clipped:
            # include the tail of its blur: without it the centroid of a few pixels is biased
            region = (
                ndimage.binary_dilation(region, EIGHT_NEIGHBOURS, iterations=FOOT_PIXELS) & inside
            )
            cut = floor
        rows, columns = np.nonzero(region)
        weights = np.clip(grey[region], cut, floor + tall) - cut
        if not weights.sum() > 0:
            weights = np.ones(len(rows))
        found.append(
            Blob(rows + box[0].start, columns + box[1].start, weights, around,
                 peak, clipped)
        )  # fmt: skip
    return found


def _largest(
    region: NDArray[np.bool_], core: NDArray[np.bool_], height: Array
) -> NDArray[np.bool_]:
    """The connected part of the region that touches the core and has the most light. A clipped
    highlight with specks around it has no single brightest pixel."""
    labels, _ = ndimage.label(region, EIGHT_NEIGHBOURS)
    within = np.unique(labels[core & region])
    sums = ndimage.sum_labels(height, labels, within)
    return labels == within[int(np.argmax(sums))]


def _grown(box: tuple[slice, ...], by: int, shape: tuple[int, ...]) -> tuple[slice, slice]:
    row, column = (
        slice(max(0, s.start - by), min(size, s.stop + by))
        for s, size in zip(box, shape, strict=True)
    )
    return row, column
