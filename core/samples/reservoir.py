"""A uniform part of more samples than an estimator needs, the same whoever brings them when.

Bottom-k sampling (Cohen & Kaplan 2007, "Summarizing data using bottom-k sketches"): every sample
has a number that looks random, a hash of photo and pixel, and those with the smallest are kept. So
the choice depends on neither order, pieces nor threads. Photos get equal room, and what one does
not need goes to the others. Within a photo all angles are thinned alike: what is rare by the scan's
normals is partly what wrong normals make so; keeping more of it did not help.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from .table import SampleTable

SIZE = 500_000
ALL = np.uint64(2**64 - 1)


def sample_hash(photo: NDArray[np.integer], pixel: NDArray[np.integer]) -> NDArray[np.uint64]:
    """(n,) a number for every pixel (n,) of photos (n,): no two are equal (the finaliser of
    SplitMix64 is a bijection: Steele, Lea & Flood 2014, "Fast splittable pseudorandom number
    generators")."""
    z = photo.astype(np.uint64) << np.uint64(32)
    z |= pixel.astype(np.uint64)
    z += np.uint64(0x9E3779B97F4A7C15)
    for shift, factor in ((30, 0xBF58476D1CE4E5B9), (27, 0x94D049BB133111EB)):
        z ^= z >> np.uint64(shift)
        z *= np.uint64(factor)
    z ^= z >> np.uint64(31)
    return z


def water_level(counts: NDArray[np.integer], size: int) -> int:
    """The most that each may keep so that all together keep no more than ``size``; counts: (c,)
    what they have."""
    counts = np.sort(counts[counts > 0])
    if counts.sum() <= size:
        return int(counts[-1]) if len(counts) else 0
    kept = np.concatenate([[0], np.cumsum(counts)[:-1]])  # by the smaller ones, whole
    left = np.arange(len(counts), 0, -1)
    full = np.flatnonzero(kept + counts * left > size)[0]  # the first that cannot be kept whole
    return int((size - kept[full]) // left[full])


class SampleReservoir:
    """At most ``size`` samples of one material from all ``photos``, but one of every photo in any
    case; a SampleSink.

    Where there are no more than ``size`` all are kept. Otherwise the rows' ``weight`` says how many
    samples of their photo each stands for. The one sample that is brightest for its light (mean of
    L / E) is kept beyond that: the paper takes it for the specular peak.
    """

    def __init__(self, photos: int, size: int = SIZE) -> None:
        self.size = size
        self._parts: list[SampleTable] = []
        self._hashes: list[NDArray[np.uint64]] = []
        self._waiting = 0
        self._counts = np.zeros(max(photos, 1), np.int64)  # what came, kept or not
        self._limits = np.full(max(photos, 1), ALL)  # of a photo: hashes above are out
        self._brightest: tuple[float, int, SampleTable] | None = None  # L / E, −place, the sample

    def add(self, photo: int, table: SampleTable) -> None:
        """Some samples of one photo."""
        if not len(table):
            return
        self._look_for_brighter(table)
        self._counts[photo] += len(table)
        number = sample_hash(table.photo, table.pixel)
        if self._limits[photo] < ALL:
            rows = np.flatnonzero(number <= self._limits[photo])
            if not len(rows):
                return
            table, number = table.select(rows), number[rows]
        self._parts.append(table)
        self._hashes.append(number)
        self._waiting += len(table)
        if self._waiting > self.size:
            self._settle()

    def table(self) -> SampleTable:
        """What was kept, in the order of photo and pixel."""
        if not self._parts:
            return SampleTable.empty()
        self._settle()
        found = SampleTable.concatenate(self._parts)
        kept = np.bincount(found.photo, minlength=len(self._counts))
        each = (self._counts / np.maximum(kept, 1)).astype(np.float32)
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

    def _look_for_brighter(self, table: SampleTable) -> None:
        light = table.radiance[:, 0] / table.irradiance[:, 0]
        for channel in (1, 2):
            light += table.radiance[:, channel] / table.irradiance[:, channel]
        row = int(np.argmax(light))
        one = table.select(np.array([row]))
        found = float(light[row]), -int(_place(one)[0])
        if self._brightest is None or found > self._brightest[:2]:
            self._brightest = (*found, one)

    def _settle(self) -> None:
        """Drop what is out. Counts only grow, so a photo's room only shrinks: what is dropped now
        would be in the end."""
        self._waiting = 0
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
