"""Several exposures of one viewpoint → one radiance image with its variance.

Inverse-variance weighting with the photos' own noise model (Granados et al. 2010, "Optimal HDR
reconstruction with linear digital cameras"). The weight of a pixel comes from a first estimate
shared by all exposures. Its own noisy value would bias the weights towards dark pixels. Photos are
read one at a time, twice each, so memory does not grow with their number.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from ..counted import counted
from ..errors import InputError
from ..noise import PhotoNoise
from .noise_estimate import estimate_noise
from .photo import Photo

Source = Photo | Callable[[], Photo]

ROWS = 256
COMPARED_PIXELS = 500_000  # for the ratio of two exposures
MIN_SNR = 2.0  # standard deviations: a weaker signal counts as noise
# ratio of exposures: signal over noise of a used pixel, pixels needed, relative error to report
RATIO_MIN_SNR, RATIO_MIN_PIXELS, RATIO_MAX_ERROR = 5.0, 200, 0.05
# a pixel disagrees beyond so many standard deviations plus this share of the signal; share of
# disagreeing pixels to report
MOVED_SIGMA, MOVED_RELATIVE, MOVED_MAX_SHARE = 6.0, 0.1, 0.02
# of the signal: smallest standard deviation, so that photos without noise have finite weights
MIN_RELATIVE_STD = 1e-4


@dataclass(frozen=True)
class Merged:
    """A merged bracket.

    radiance: (h, w, 3) per unit exposure; variance: (h, w, 3) of it; valid: (h, w) at least one
    exposure is not clipped (elsewhere radiance is 0 and variance inf). In the order of the photos:
    factors: measured over stated exposure, relative to the longest exposure (nan: too few pixels
    to compare); moved: share of pixels that disagree with the other exposures beyond noise.
    warnings: sentences.
    """

    radiance: NDArray[np.float32]
    variance: NDArray[np.float32]
    valid: NDArray[np.bool_]
    factors: tuple[float, ...]
    moved: tuple[float, ...]
    warnings: tuple[str, ...]


def merge_bracket(
    photos: Sequence[Source],
    exposures: Sequence[float],
    noise: Sequence[PhotoNoise] | None = None,
    names: Sequence[str] | None = None,
) -> Merged:
    """Merge photos (or functions that read them) taken with relative ``exposures`` > 0.

    A channel is used where it is not clipped and above the noise; the longest exposure that is not
    clipped is always used. noise: one model per photo, estimated from each photo where None. names:
    of the photos, for warnings. Raises InputError for impossible exposures or photos of different
    sizes.
    """
    if not photos or len(photos) != len(exposures):
        raise InputError(
            f"found {counted(len(photos), 'photo')} and "
            f"{counted(len(exposures), 'exposure')}; expected one exposure per photo"
        )
    if not all(math.isfinite(e) and e > 0 for e in exposures):
        raise InputError(f"found exposures {list(exposures)}; expected positive numbers")
    order = sorted(range(len(photos)), key=lambda i: -exposures[i])
    first = _first_estimate(photos, exposures, noise, order)
    merged = _weighted(photos, exposures, first, order)
    photo_names = names or [f"photo {i + 1}" for i in range(len(photos))]
    return Merged(
        merged.radiance,
        merged.variance,
        first.longest < len(photos),
        first.factors,
        merged.moved,
        _warnings(photo_names, exposures, first.factors, merged.moved),
    )


@dataclass(frozen=True)
class _First:
    """First estimate. estimate: (h, w, 3) radiance; longest: (h, w) index, by descending exposure,
    of the longest exposure that is not clipped, or the number of photos."""

    estimate: NDArray[np.float32]
    longest: NDArray[np.uint16]
    noise: tuple[PhotoNoise, ...]
    factors: tuple[float, ...]


@dataclass(frozen=True)
class _Weighted:
    radiance: NDArray[np.float32]
    variance: NDArray[np.float32]
    moved: tuple[float, ...]


def _first_estimate(
    photos: Sequence[Source],
    exposures: Sequence[float],
    noise: Sequence[PhotoNoise] | None,
    order: list[int],
) -> _First:
    """Sum of unclipped pixels over sum of their exposures: unbiased, and optimal where there is
    only shot noise. Also compares each exposure with the next longer one."""
    total = weight = longest = None
    noises: dict[int, PhotoNoise] = {}
    steps: dict[int, float] = {}
    before: tuple[int, NDArray, NDArray] | None = None
    for place, i in enumerate(order):
        photo = _read(photos[i])
        if total is None or weight is None or longest is None:
            total = np.zeros_like(photo.radiance)
            weight = np.zeros(photo.clipped.shape, np.float32)
            longest = np.full(photo.clipped.shape, len(order), np.uint16)
        if photo.radiance.shape != total.shape:
            raise InputError(
                f"bracketed photos have {photo.clipped.shape[::-1]} and {weight.shape[::-1]} "
                "pixels; expected one size"
            )
        noises[i] = estimate_noise(photo) if noise is None else noise[i]
        usable = ~photo.clipped
        longest[usable & (longest == len(order))] = place
        usable &= ~photo.black | (longest == place)
        for top in range(0, len(total), ROWS):
            rows = slice(top, top + ROWS)
            total[rows] += photo.radiance[rows] * usable[rows, :, None]
        weight += usable * np.float32(exposures[i])
        step = max(1, math.isqrt(usable.size // COMPARED_PIXELS))
        sample = photo.radiance[::step, ::step], photo.clipped[::step, ::step]
        if before is not None:
            steps[i] = _exposure_ratio(before, (i, *sample), exposures, noises)
        before = i, sample[0].copy(), sample[1].copy()
    assert total is not None and weight is not None and longest is not None
    total /= np.maximum(weight, np.float32(min(exposures)))[:, :, None]
    factors, along = dict.fromkeys(order, 1.0), 1.0
    for i in order[1:]:
        along *= steps[i]
        factors[i] = along
    count = range(len(photos))
    return _First(total, longest, tuple(noises[i] for i in count), tuple(factors[i] for i in count))


def _exposure_ratio(
    longer: tuple[int, NDArray, NDArray],
    shorter: tuple[int, NDArray, NDArray],
    exposures: Sequence[float],
    noises: dict[int, PhotoNoise],
) -> float:
    """Median of (shorter / its exposure) / (longer / its exposure). Pixels are selected by the
    value in the longer exposure; selecting by the shorter one's noisy value would bias the
    median."""
    i, bright, bright_clipped = longer
    j, dark, dark_clipped = shorter
    expected = bright * np.float32(exposures[j] / exposures[i])
    used = expected > RATIO_MIN_SNR * np.sqrt(noises[j].variance(expected))
    used &= (bright > RATIO_MIN_SNR * np.sqrt(noises[i].variance(bright))) & (expected > 0)
    used &= ~(bright_clipped | dark_clipped)[:, :, None]
    if used.sum() < RATIO_MIN_PIXELS:
        return math.nan
    return float(np.median(dark[used] / expected[used]))


def _weighted(
    photos: Sequence[Source], exposures: Sequence[float], first: _First, order: list[int]
) -> _Weighted:
    total = np.zeros_like(first.estimate)
    weight = np.zeros_like(first.estimate)
    moved = dict.fromkeys(order, 0.0)
    for place, i in enumerate(order):
        photo, exposure = _read(photos[i]), np.float32(exposures[i])
        off = seen = 0
        for top in range(0, len(total), ROWS):
            rows = slice(top, top + ROWS)
            expected = np.maximum(first.estimate[rows] * exposure, 0)
            variance = first.noise[i].variance(expected)
            variance += (np.float32(MIN_RELATIVE_STD) * expected) ** 2 + np.float32(1e-20)
            usable = (expected > MIN_SNR * np.sqrt(variance)) & ~photo.black[rows, :, None]
            usable |= (first.longest[rows] == place)[:, :, None]
            usable &= ~photo.clipped[rows, :, None]
            pixel_weight = np.where(usable, exposure**2 / variance, np.float32(0))
            total[rows] += pixel_weight * (photo.radiance[rows] / exposure)
            weight[rows] += pixel_weight
            away = np.abs(photo.radiance[rows] - expected)
            odd = away > MOVED_SIGMA * np.sqrt(variance) + MOVED_RELATIVE * expected
            off += int((odd & usable).any(axis=2).sum())
            seen += int(usable.any(axis=2).sum())
        moved[i] = off / seen if seen else 0.0
    with np.errstate(divide="ignore", invalid="ignore"):
        np.divide(total, weight, out=total)
        np.divide(1, weight, out=weight)
    np.nan_to_num(total, copy=False, nan=0.0, posinf=0.0, neginf=0.0)
    return _Weighted(total, weight, tuple(moved[i] for i in range(len(photos))))


def _read(source: Source) -> Photo:
    return source if isinstance(source, Photo) else source()


def _warnings(
    names: Sequence[str],
    exposures: Sequence[float],
    factors: tuple[float, ...],
    moved: tuple[float, ...],
) -> tuple[str, ...]:
    found = []
    for name, exposure, factor, part in zip(names, exposures, factors, moved, strict=True):
        if math.isnan(factor):
            found.append(
                f"{name} shares too few usable pixels with the next longer exposure, so its "
                "exposure could not be checked."
            )
        elif abs(factor - 1) > RATIO_MAX_ERROR:
            found.append(
                f"{name} has the exposure {exposure * factor:.4g} by its pixels, but "
                f"{exposure:.4g} is given ({100 * (factor - 1):+.0f} %). Give the measured "
                "exposure."
            )
        if part > MOVED_MAX_SHARE:
            found.append(
                f"{name} disagrees with the other exposures in {100 * part:.0f} % of its pixels. "
                "Check whether the camera or the object moved."
            )
    return tuple(found)
