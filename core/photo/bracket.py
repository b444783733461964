"""Several exposures of one viewpoint → one radiance image with its variance.

Inverse-variance weighting with the photos' own noise model (Granados et al. 2010, "Optimal HDR
reconstruction with linear digital cameras"). The weight of a pixel is taken from a first estimate
that all exposures share, not from its own noisy value, which would favour pixels that came out
dark. Photos are asked for one at a time, twice each: memory does not grow with their number.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from ..errors import InputError
from .noise import Noise, estimate_noise
from .photo import Photo

Source = Photo | Callable[[], Photo]

ROWS = 256
SAMPLES = 500_000  # pixels that exposures are compared on
DOMINATED = 2.0  # signal below so many standard deviations is noise
RATIO_SIGNAL, RATIO_FEWEST, RATIO_OFF = 5.0, 200, 0.05
MOVED_SIGMA, MOVED_PART, MOVED_OFF = 6.0, 0.1, 0.02
RELATIVE_FLOOR = 1e-4  # standard deviation that no model is trusted below, as a part of the signal


@dataclass(frozen=True)
class Merged:
    """radiance (h, w, 3) per unit exposure, variance (h, w, 3) of it, valid (h, w): some exposure
    was not clipped there (radiance 0 and variance inf elsewhere); in the order of the photos:
    factors: measured exposure over stated one, against the longest (nan: could not be compared);
    moved: part of the pixels that disagree with the others beyond noise; warnings: sentences."""

    radiance: NDArray[np.float32]
    variance: NDArray[np.float32]
    valid: NDArray[np.bool_]
    factors: tuple[float, ...]
    moved: tuple[float, ...]
    warnings: tuple[str, ...]


def merge_bracket(
    photos: Sequence[Source],
    exposures: Sequence[float],
    noise: Sequence[Noise] | None = None,
    names: Sequence[str] | None = None,
) -> Merged:
    """Merge photos (or functions that read them) taken with relative ``exposures`` > 0.

    A channel counts where it is not clipped and stands out of the noise; the longest exposure that
    is not clipped always counts. ``noise`` is estimated from each photo where it is not given.
    Raises InputError for exposures that cannot be, or photos of different sizes.
    """
    if not photos or len(photos) != len(exposures):
        raise InputError(f"{len(photos)} photos, but {len(exposures)} exposures")
    if not all(math.isfinite(e) and e > 0 for e in exposures):
        raise InputError(f"exposures must be positive numbers; found {list(exposures)}")
    order = sorted(range(len(photos)), key=lambda i: -exposures[i])
    first = _first_estimate(photos, exposures, noise, order)
    numbers = _weighted(photos, exposures, first, order)
    called = names or [f"photo {i + 1}" for i in range(len(photos))]
    return Merged(
        numbers.radiance,
        numbers.variance,
        first.longest < len(photos),
        first.factors,
        numbers.moved,
        _warnings(called, exposures, first.factors, numbers.moved),
    )


@dataclass(frozen=True)
class _First:
    """estimate (h, w, 3) radiance; longest (h, w): place in the order of the longest exposure that
    is not clipped, or the number of photos."""

    estimate: NDArray[np.float32]
    longest: NDArray[np.uint16]
    noise: tuple[Noise, ...]
    factors: tuple[float, ...]


@dataclass(frozen=True)
class _Weighted:
    radiance: NDArray[np.float32]
    variance: NDArray[np.float32]
    moved: tuple[float, ...]


def _first_estimate(
    photos: Sequence[Source],
    exposures: Sequence[float],
    noise: Sequence[Noise] | None,
    order: list[int],
) -> _First:
    """Sum of unclipped pixels over sum of exposures: unbiased, and best for shot noise alone."""
    total = weight = longest = None
    noises: dict[int, Noise] = {}
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
                f"bracketed photos differ in size: {photo.clipped.shape[::-1]} and "
                f"{weight.shape[::-1]} pixels"
            )
        noises[i] = estimate_noise(photo) if noise is None else noise[i]
        usable = ~photo.clipped
        longest[usable & (longest == len(order))] = place
        usable &= ~photo.black | (longest == place)
        for top in range(0, len(total), ROWS):
            rows = slice(top, top + ROWS)
            total[rows] += photo.radiance[rows] * usable[rows, :, None]
        weight += usable * np.float32(exposures[i])
        step = max(1, math.isqrt(usable.size // SAMPLES))
        sample = photo.radiance[::step, ::step], photo.clipped[::step, ::step]
        if before is not None:
            steps[i] = _factor(before, (i, *sample), exposures, noises)
        before = i, sample[0].copy(), sample[1].copy()
    assert total is not None and weight is not None and longest is not None
    total /= np.maximum(weight, np.float32(min(exposures)))[:, :, None]
    factors, along = dict.fromkeys(order, 1.0), 1.0
    for i in order[1:]:
        along *= steps[i]
        factors[i] = along
    count = range(len(photos))
    return _First(total, longest, tuple(noises[i] for i in count), tuple(factors[i] for i in count))


def _factor(
    longer: tuple[int, NDArray, NDArray],
    shorter: tuple[int, NDArray, NDArray],
    exposures: Sequence[float],
    noises: dict[int, Noise],
) -> float:
    """Median of (shorter / its exposure) / (longer / its exposure). Pixels are chosen by the longer
    one: chosen by the shorter one's own value, its noise would bias the median."""
    i, bright, bright_clipped = longer
    j, dark, dark_clipped = shorter
    expected = bright * np.float32(exposures[j] / exposures[i])
    sure = expected > RATIO_SIGNAL * np.sqrt(noises[j].variance(expected))
    sure &= (bright > RATIO_SIGNAL * np.sqrt(noises[i].variance(bright))) & (expected > 0)
    sure &= ~(bright_clipped | dark_clipped)[:, :, None]
    if sure.sum() < RATIO_FEWEST:
        return math.nan
    return float(np.median(dark[sure] / expected[sure]))


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
            variance += (np.float32(RELATIVE_FLOOR) * expected) ** 2 + np.float32(1e-20)
            usable = (expected > DOMINATED * np.sqrt(variance)) & ~photo.black[rows, :, None]
            usable |= (first.longest[rows] == place)[:, :, None]
            usable &= ~photo.clipped[rows, :, None]
            pixel_weight = np.where(usable, exposure**2 / variance, np.float32(0))
            total[rows] += pixel_weight * (photo.radiance[rows] / exposure)
            weight[rows] += pixel_weight
            away = np.abs(photo.radiance[rows] - expected)
            odd = away > MOVED_SIGMA * np.sqrt(variance) + MOVED_PART * expected
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
                f"{name}: too few pixels in common with the next longer exposure; its exposure "
                "could not be checked"
            )
        elif abs(factor - 1) > RATIO_OFF:
            found.append(
                f"{name}: its pixels say exposure {exposure * factor:.4g}, not {exposure:.4g} "
                f"({100 * (factor - 1):+.0f} %); give the measured one"
            )
        if part > MOVED_OFF:
            found.append(
                f"{name}: {100 * part:.0f} % of its pixels disagree with the other exposures; "
                "was the camera or the object moved?"
            )
    return tuple(found)
