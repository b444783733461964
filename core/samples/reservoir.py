"""A uniform subset of the samples where there are more than an estimator needs, independent of the
order in which they arrive.

Bottom-k sampling (Cohen & Kaplan 2007, "Summarizing data using bottom-k sketches"): every sample
has a pseudo-random number, a hash of photo and pixel, and those with the smallest numbers are kept.
The choice therefore depends on neither order, batches nor threads. Photos get equal room; what one
does not need goes to the others. Within a photo all angles are thinned alike: angles that are rare
by the scan's normals are partly the result of wrong normals, and keeping more of them did not help.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from .table import SampleTable

SIZE = 500_000  # samples of one material
ALL = np.uint64(2**64 - 1)


def sample_hash(photo: NDArray[np.integer], pixel: NDArray[np.integer]) -> NDArray[np.uint64]:
    """(n,) a unique pseudo-random number for each pixel (n,) of photos (n,): the finaliser of
    SplitMix64, a bijection (Steele, Lea & Flood 2014, "Fast splittable pseudorandom number
    generators")."""
    z = photo.astype(np.uint64) << np.uint64(32)
    z |= pixel.astype(np.uint64)
    z += np.uint64(0x9E3779B97F4A7C15)
    for shift, factor in ((30, 0xBF58476D1CE4E5B9), (27, 0x94D049BB133111EB)):
        z ^= z >> np.uint64(shift)
        z *= np.uint64(factor)
    z ^= z >> np.uint64(31)
    return z


def brightness(
    radiance: NDArray[np.float32], irradiance: NDArray[np.float32]
) -> NDArray[np.float32]:
    """(n,) sum of L / E over the channels. radiance: (n, 3); irradiance: (n, 3), or (1, 3) for
    all."""
    light = radiance[:, 0] / irradiance[:, 0]
    for channel in (1, 2):
        light += radiance[:, channel] / irradiance[:, channel]
    return light


def water_level(counts: NDArray[np.integer], size: int) -> int:
    """The largest number that each may keep so that all together keep at most ``size``; counts:
    (c,) how many each has."""
    counts = np.sort(counts[counts > 0])
    if counts.sum() <= size:
        return int(counts[-1]) if len(counts) else 0
    kept = np.concatenate(
        [[0], np.cumsum(counts)[:-1]]
    )  # by all smaller ones, which are kept whole
    left = np.arange(len(counts), 0, -1)
    full = np.flatnonzero(kept + counts * left > size)[0]  # the first that cannot be kept whole
    return int((size - kept[full]) // left[full])


class SampleReservoir:
    """Keeps at most ``size`` samples of one material from ``photos`` photos, at least one of every
    photo; a SampleSink.

    Up to ``size`` samples are all kept. Otherwise ``weight`` of a row says how many samples of its
    photo it represents. The one sample that is brightest relative to its irradiance (mean of L / E)
    is kept in addition: the paper assumes that it is the specular peak (equation (9)).
    """

    def __init__(self, photos: int, size: int = SIZE) -> None:
        self.size = size
        self._parts: list[SampleTable] = []
        self._hashes: list[NDArray[np.uint64]] = []
        self._pending = 0
        self._counts = np.zeros(max(photos, 1), np.int64)  # samples added, kept or not
        self._limits = np.full(
            max(photos, 1), ALL
        )  # of a photo: samples with larger hashes are dropped
        self._brightest: tuple[float, int, SampleTable] | None = None  # L / E, −place, the sample

    def limit(self, photo: int) -> np.uint64:
        """Samples of a photo with larger hashes are dropped. It only falls, so that other threads
        can use it at any time (take.rows_below)."""
        return self._limits[photo]

    def add(self, photo: int, table: SampleTable, count: int | None = None) -> None:
        """Add some samples of one photo. count: how many there were where those that are dropped
        anyway were left out of the table; None if it is complete."""
        if not len(table):
            return
        self._update_brightest(table)
        self._counts[photo] += len(table) if count is None else count
        number = sample_hash(table.photo, table.pixel)
        if self._limits[photo] < ALL:
            rows = np.flatnonzero(number <= self._limits[photo])
            if not len(rows):
                return
            table, number = table.select(rows), number[rows]
        self._parts.append(table)
        self._hashes.append(number)
        self._pending += len(table)
        if self._pending > self.size:
            self._prune()

    def table(self, like: SampleReservoir | None = None) -> SampleTable:
        """The samples that were kept, in the order of photo and pixel.

        like: a reservoir of other samples of the same photos; only those that it would keep too are
        returned, and each stands for as many as its samples do. So both are thinned alike, and a
        small region of angles has both kinds of samples in the proportion of its pixels.
        """
        if not self._parts:
            return SampleTable.empty()
        self._prune()
        found = SampleTable.concatenate(self._parts)
        kept = np.bincount(found.photo, minlength=len(self._counts))
        each = (self._counts / np.maximum(kept, 1)).astype(np.float32)
        if like is not None:
            like._prune()
            number = np.concatenate(self._hashes)
            found = found.select(np.flatnonzero(number <= like._limits.take(found.photo)))
            both = np.minimum(self._limits, like._limits)
            # the inverse of the probability to be kept: of few samples a count would say little
            each = np.where(both < ALL, 2.0**64 / (both.astype(np.float64) + 1), 1.0)
            each = each.astype(np.float32)
        found = replace(found, weight=found.weight * each.take(found.photo))
        place = _place(found)
        if self._brightest is not None:
            one = self._brightest[2]
            if not (place == _place(one)).any():
                found = SampleTable.concatenate([found, one])
                place = _place(found)
        if (np.diff(place) > 0).all():
            return found
        return found.select(np.argsort(place, kind="stable"))

    def _update_brightest(self, table: SampleTable) -> None:
        """Remember the sample with the largest mean of L / E."""
        light = brightness(table.radiance, table.irradiance)
        row = int(np.argmax(light))
        one = table.select(np.array([row]))
        found = float(light[row]), -int(_place(one)[0])
        if self._brightest is None or found > self._brightest[:2]:
            self._brightest = (*found, one)

    def _prune(self) -> None:
        """Drop samples above the limits. Counts only grow, so the room of a photo only shrinks:
        what is dropped now would be dropped in the end."""
        self._pending = 0
        if self._counts.sum() <= self.size:
            return
        room = max(1, water_level(self._counts, self.size))
        of = np.array([part.photo[0] for part in self._parts])
        for photo in np.unique(of).tolist():
            mine = np.concatenate([self._hashes[i] for i in np.flatnonzero(of == photo)])
            if len(mine) > room:
                self._limits[photo] = np.partition(mine, room - 1)[room - 1]
        parts, hashes = self._parts, self._hashes
        self._parts, self._hashes = [], []
        for photo, table, number in zip(of.tolist(), parts, hashes, strict=True):
            rows = np.flatnonzero(number <= self._limits[photo])
            if len(rows):
                whole = len(rows) == len(table)
                self._parts.append(table if whole else table.select(rows))
                self._hashes.append(number if whole else number[rows])


def _place(table: SampleTable) -> NDArray[np.int64]:
    """(n,) one number for photo and pixel, in their order."""
    return table.photo.astype(np.int64) << 32 | table.pixel
