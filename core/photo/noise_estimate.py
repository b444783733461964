"""Estimate the noise model of a photo from the photo itself.

Model (EMVA 1288; Foi et al. 2008, "Practical Poissonian-Gaussian noise modeling and fitting for
single-image raw-data"): var = read² + shot · L. Small blocks are high-pass filtered with the mask
of Immerkær 1996 ("Fast noise variance estimation"), which is zero for linear shading. Texture can
only increase the residual of a block, so the line is fitted to the lower edge of the blocks: those
whose residuals agree with chi-squared noise about it.

Demosaicing, sharpening and lossy compression correlate the noise of neighbouring pixels, and a
filter of direct neighbours then underestimates it. The mask is therefore also applied with steps
of 2 and 4 pixels, and the smallest step is used from which the estimate stops growing. Where
texture grows with the step too, the estimate is too high.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import nnls
from scipy.stats import chi2

from ..noise import PhotoNoise
from .photo import Photo

BLOCK_SIZES = (16, 8)  # pixels; the smaller where too few larger blocks are without clipped pixels
STEPS = (1, 2, 4)  # pixels between the samples of the mask
PIXELS_PER_DOF = 4.2  # residuals per degree of freedom: sum of the mask's squared autocorrelation
START_QUANTILE = 0.2  # of the blocks of a brightness bin; the fit starts from it
KEEP_QUANTILE = 0.95  # of the chi-squared distribution; blocks above it are rejected
CORRELATED_GROWTH = 1.3  # ratio of variances at successive steps that counts as correlation
# block counts: for the larger block size; to trust a larger step; for a fit; used at most
LARGE_BLOCKS, STEP_BLOCKS, MIN_BLOCKS, MAX_BLOCKS = 300, 100, 30, 20_000
BINS, MIN_BIN_BLOCKS, BIN_TOLERANCE = 24, (6, 12), 0.3  # brightness bins; blocks per bin; in ln


@dataclass(frozen=True)
class _Line:
    """Noise variance of one channel as a straight line over brightness: read2 + shot · light, where
    read2 is the squared read noise. blocks: number of blocks that the fit used."""

    shot: float
    read2: float
    blocks: int

    def at(self, light: NDArray) -> NDArray:
        return self.read2 + self.shot * np.maximum(light, 0.0)


def estimate_noise(photo: Photo) -> PhotoNoise:
    """The noise model of one photo, from its blocks with the least texture.

    Clipped and black pixels are excluded. The variance is never below that of quantisation
    (step²/12).
    """
    floor = _quantisation(photo)
    size = next(
        (b for b in BLOCK_SIZES if len(_blocks(photo, 1, b)[0]) >= LARGE_BLOCKS), BLOCK_SIZES[-1]
    )
    found = [_blocks(photo, step, size) for step in STEPS]
    freedom = size**2 / PIXELS_PER_DOF
    shot, read2 = np.zeros(3), np.zeros(3)
    used, support = 1, np.zeros(3, int)
    for channel in range(3):
        line, step = _channel(found, channel, freedom)
        shot[channel] = max(line.shot, floor.shot)
        read2[channel] = max(line.read2, floor.read2)
        used, support[channel] = max(used, step), line.blocks
    known = support > 0
    if known.any():  # a channel without an estimate gets the largest of the others
        shot[~known], read2[~known] = shot[known].max(), read2[known].max()
    return PhotoNoise(shot, np.sqrt(read2), used, int(support[known].min()) if known.any() else 0)


def _channel(
    found: list[tuple[NDArray, NDArray]], channel: int, freedom: float
) -> tuple[_Line, int]:
    """The line at the smallest step from which the variance stops growing."""
    lines = [_fit(light[:, channel], spread[:, channel], freedom) for light, spread in found]
    best, step = lines[0], STEPS[0]
    for line, after in zip(lines[1:], STEPS[1:], strict=True):
        light = found[0][0][:, channel]
        if not best.blocks or line.blocks < STEP_BLOCKS:
            break
        growth = np.median(line.at(light)) / max(np.median(best.at(light)), 1e-30)
        if growth < CORRELATED_GROWTH:
            break
        best, step = line, after
    return best, step


def _blocks(photo: Photo, step: int, size: int) -> tuple[NDArray, NDArray]:
    """((n, 3) mean light, (n, 3) variance of the high-pass residual) of the usable blocks.

    step: of the mask, pixels; size: of the blocks, pixels.
    """
    height, width = photo.clipped.shape
    reach = size + 2 * step
    columns = (width - 2 * step) // size
    tops = np.arange(0, height - reach + 1, size)
    if columns < 1 or len(tops) < 1:
        return np.zeros((0, 3)), np.zeros((0, 3))
    every = max(1, columns * len(tops) // MAX_BLOCKS)
    light, spread = [], []
    for top in tops[::every]:
        rows = slice(top, top + reach)
        strip = photo.radiance[rows, : columns * size + 2 * step]
        lost = photo.clipped[rows, : strip.shape[1]] | (strip == 0).any(axis=2)
        down = strip[: -2 * step] - 2 * strip[step:-step] + strip[2 * step :]
        rest = (down[:, : -2 * step] - 2 * down[:, step:-step] + down[:, 2 * step :]) / 6
        lost = lost[: -2 * step] | lost[step:-step] | lost[2 * step :]
        lost = lost[:, : -2 * step] | lost[:, step:-step] | lost[:, 2 * step :]
        bad = _block_sums(lost, size) > 0
        inner = strip[step : step + size, step : step + columns * size]
        light.append(_block_sums(inner, size)[~bad] / size**2)
        spread.append(_block_sums(rest**2, size)[~bad] / size**2)
    return np.concatenate(light).astype(float), np.concatenate(spread).astype(float)


def _block_sums(strip: NDArray, size: int) -> NDArray:
    """(n, …) sum of the pixels of each block of a strip (size, n · size, …). The rows are added
    first, because long contiguous rows are added fastest."""
    rows = strip[:size].sum(axis=0)
    return np.asarray(rows.reshape(-1, size, *strip.shape[2:]).sum(axis=1))


def _fit(light: NDArray, spread: NDArray, freedom: float) -> _Line:
    """The line of variance over brightness, fitted to the blocks without texture. It starts from
    low quantiles of brightness bins; then the selection of blocks and the line are updated in turn
    until convergence."""
    usable = (spread > 0) & (light > 0)
    light, spread = light[usable], spread[usable]
    if len(light) < MIN_BLOCKS:
        return _Line(0.0, 0.0, 0)
    limit = chi2.ppf(KEEP_QUANTILE, freedom) / freedom
    # mean of the chi-squared distribution truncated at the limit
    kept_mean = chi2.cdf(limit * freedom, freedom + 2) / KEEP_QUANTILE
    line = _start(light, spread, freedom)
    for _ in range(50):
        keep = spread < limit * line.at(light)
        if keep.sum() < MIN_BLOCKS:
            break
        after = _weighted(light[keep], spread[keep] / kept_mean, line.at(light[keep]))
        done = np.allclose(after.at(light), line.at(light), rtol=1e-4)
        line = _Line(after.shot, after.read2, int(keep.sum()))
        if done:
            break
    return line if line.blocks >= MIN_BLOCKS else _Line(0.0, 0.0, 0)


def _start(light: NDArray, spread: NDArray, freedom: float) -> _Line:
    """The line of variance over brightness on which the low quantiles of most brightness bins lie.

    Bins with texture everywhere lie above it; none can lie below. Each brightness bin has one vote,
    so that a large dark background does not outvote the object.
    """
    # the shift merges brightnesses that differ only by noise
    shifted = np.log(
        light + 10 * np.sqrt(np.quantile(spread, START_QUANTILE) / (PIXELS_PER_DOF * freedom))
    )
    low, high = np.quantile(shifted, (0.01, 0.99))
    place = np.digitize(shifted, np.linspace(low, max(high, low + 1e-3), BINS))
    least = int(np.clip(len(light) // 30, *MIN_BIN_BLOCKS))
    bins = [part for k in range(BINS + 1) if len(part := np.flatnonzero(place == k)) >= least]
    if not bins:
        bins = [np.arange(len(light))]
    middle = np.array([light[part].mean() for part in bins])
    quiet = np.array([np.quantile(spread[part], START_QUANTILE) for part in bins])
    quiet /= chi2.ppf(START_QUANTILE, freedom) / freedom
    first, second = np.triu_indices(len(bins))
    rise = middle[second] - middle[first]
    shot = np.where(rise > 0, (quiet[second] - quiet[first]) / np.where(rise > 0, rise, 1.0), 0.0)
    shot = np.concatenate([shot, quiet / middle])  # and lines without read noise
    read2 = np.concatenate([quiet[first] - shot[: len(first)] * middle[first], 0 * quiet])
    possible = (shot >= 0) & (read2 >= 0)
    shot, read2 = shot[possible], read2[possible]
    ratio = quiet / np.maximum(read2[:, None] + shot[:, None] * middle, 1e-30)
    votes = (np.abs(np.log(ratio)) < BIN_TOLERANCE).sum(axis=1)
    votes -= (ratio < 1 / (1 + 2 * BIN_TOLERANCE)).sum(axis=1)
    line = _Line(*max(zip(votes, -read2 - shot * middle.mean(), shot, read2, strict=True))[2:], 0)
    agrees = np.abs(np.log(quiet / np.maximum(line.at(middle), 1e-30))) < BIN_TOLERANCE
    return _weighted(middle[agrees], quiet[agrees], quiet[agrees]) if agrees.sum() > 2 else line


def _weighted(light: NDArray, spread: NDArray, expected: NDArray) -> _Line:
    """Non-negative least squares of (spread − read² − shot · light) / expected."""
    matrix = np.stack([np.ones_like(light), light], axis=1) / expected[:, None]
    scale = np.abs(matrix).max(axis=0)
    (read2, shot), _ = nnls(matrix / scale, spread / expected)
    return _Line(float(shot / scale[1]), float(read2 / scale[0]), len(light))


def _quantisation(photo: Photo) -> _Line:
    """Variance of rounding to the discrete pixel values of the file, step²/12. The straight line
    over brightness goes through its values for dark pixels and for pixels at half of the scale."""
    levels = photo.info.levels
    if levels is None or not photo.info.transfer.curves:
        return _Line(0.0, 0.0, 0)
    table = photo.info.transfer.table(levels)
    step2 = (np.diff(table, axis=0) ** 2).mean(axis=1) / 12
    dark, half = float(step2[0]), levels // 2
    at_half = float(table[half].mean())
    return _Line(max(float(step2[half]) - dark, 0.0) / max(at_half, 1e-9), dark, 0)
