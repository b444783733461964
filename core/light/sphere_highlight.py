"""The highlights on a sphere in a photo: which pixels, how bright, clipped or not."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy import ndimage

Array = NDArray[np.float64]

FAINTEST = (
    0.1  # of the brightest highlight's height above the sphere's median: below it none is seen
)
NOISE = 8.0  # median absolute deviations above the median
CUT = 0.2  # of a highlight's height: what is above it is the highlight
FOOT = 2  # pixels around it that belong to a highlight that stands alone
CLIPPED_CUT = 0.9  # the same where the height is that of the clipped plateau
PLATEAU = 0.995  # of the brightest value: pixels of a clipped plateau are all above it
MOST = 12  # highlights reported
EIGHT = np.ones((3, 3), bool)


@dataclass(frozen=True)
class Blob:
    """One highlight. rows, columns: (n,) its pixels. weights: (n,) what each counts for its place.
    background: (3,) radiance around it. peak: (3,) of its brightest pixel. clipped: whether that is
    the sensor's limit."""

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

    saturation: the value from which a channel is clipped; where None, a plateau of three or more
    equally bright pixels tells. Regions above a faint level are split where they hold several
    peaks of more than half the region's height; each is then cut at a part of its own height.
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
    low = level + max(FAINTEST * (top - level), NOISE * spread)
    regions, count = ndimage.label((grey > low) & inside, EIGHT)
    blobs: list[Blob] = []
    if count == 0:
        return blobs
    boxes = ndimage.find_objects(regions)
    sums = ndimage.sum_labels(grey, regions, np.arange(1, count + 1))
    for index in np.argsort(-sums)[: 4 * MOST]:
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
    ring = ndimage.binary_dilation(own, EIGHT, iterations=6) & inside
    ring &= ~ndimage.binary_dilation(any_region, EIGHT, iterations=1)
    if ring.sum() < 8:
        ring = inside & ~any_region
    around = np.median(light[ring], axis=0) if ring.any() else np.zeros(3)
    floor = float(around.mean())
    height = float(grey[own].max()) - floor
    peaks, count = ndimage.label(own & (grey - floor > 0.5 * height), EIGHT)
    found: list[Blob] = []
    taken = np.zeros(grey.shape, bool)
    sums = ndimage.sum_labels(grey, peaks, np.arange(1, count + 1))
    for index in np.argsort(-sums)[:MOST]:
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
            # with the foot of its blur: of a highlight of a few pixels, what a cut leaves is biased
            region = ndimage.binary_dilation(region, EIGHT, iterations=FOOT) & inside
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
    """The connected part of the region with most light that touches the core: of a clipped
    highlight with specks around it no single pixel is the brightest."""
    labels, _ = ndimage.label(region, EIGHT)
    within = np.unique(labels[core & region])
    sums = ndimage.sum_labels(height, labels, within)
    return labels == within[int(np.argmax(sums))]


def _grown(box: tuple[slice, ...], by: int, shape: tuple[int, ...]) -> tuple[slice, slice]:
    row, column = (
        slice(max(0, s.start - by), min(size, s.stop + by))
        for s, size in zip(box, shape, strict=True)
    )
    return row, column
