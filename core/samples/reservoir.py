"""A uniform part of more samples than fit into memory, the same whoever brings them when.

Bottom-k sampling (Cohen & Kaplan 2007, "Summarizing data using bottom-k sketches"): every sample
has a number that looks random, and those with the smallest numbers are kept. The number is a hash
of photo and pixel, so the choice depends on neither order, pieces nor threads.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from .table import SampleTable

SIZE = 1_000_000
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


class SampleReservoir:
    """At most ``size`` samples of one material from all ``photos``; a SampleSink.

    The size // photos samples of smallest hash of every photo are kept in any case (all, where it
    has fewer); what room is left is filled by the smallest hashes of the others, whosever they are.
    Where there are no more samples than ``size`` all are kept. The one sample that is brightest for
    its light (mean of L / E) is kept beyond that: the paper takes it for the specular peak.
    """

    def __init__(self, photos: int, size: int = SIZE) -> None:
        self.size = size
        self.share = size // max(photos, 1)
        self._parts: list[SampleTable] = []
        self._hashes: list[NDArray[np.uint64]] = []
        self._waiting = 0
        self._limit = ALL  # hashes above are out, unless they are in their photo's share
        self._shares: dict[int, np.uint64] = {}  # largest hash of a photo's share, where it is full
        self._brightest: tuple[float, int, SampleTable] | None = None  # L / E, −place, the sample

    def add(self, photo: int, table: SampleTable) -> None:
        """Some samples of one photo."""
        if not len(table):
            return
        number = sample_hash(table.photo, table.pixel)
        self._look_for_brighter(table)
        limit = max(self._limit, self._shares.get(photo, ALL))
        if limit < ALL:
            rows = np.flatnonzero(number <= limit)
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
        self._parts, self._hashes = [found], [np.concatenate(self._hashes)]
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
        """Drop what is out."""
        number = np.concatenate(self._hashes)
        if len(number) > self.size:
            keep = self._best(np.concatenate([part.photo for part in self._parts]), number)
            parts, hashes = self._parts, self._hashes
            self._parts, self._hashes = [], []
            begin = 0
            for table, own in zip(parts, hashes, strict=True):
                rows = np.flatnonzero(keep[begin : begin + len(own)])
                begin += len(own)
                if len(rows) == len(own):
                    self._parts.append(table)
                    self._hashes.append(own)
                elif len(rows):
                    self._parts.append(table.select(rows))
                    self._hashes.append(own[rows])
        self._waiting = 0

    def _best(self, photo: NDArray[np.int16], number: NDArray[np.uint64]) -> NDArray[np.bool_]:
        """Rows to keep; sets the limits for what comes later."""
        sure = np.zeros(len(number), bool)
        for one in np.unique(photo).tolist():
            rows = np.flatnonzero(photo == one)
            if len(rows) > self.share:
                if self.share == 0:
                    self._shares[one] = np.uint64(0)
                    continue
                last = np.partition(number[rows], self.share - 1)[self.share - 1]
                self._shares[one] = last
                rows = rows[number[rows] <= last]
            sure[rows] = True
        others = np.flatnonzero(~sure)
        room = self.size - int(sure.sum())
        if room == 0:
            self._limit = np.uint64(0)
        elif len(others) > room:
            self._limit = np.partition(number[others], room - 1)[room - 1]
            others = others[number[others] <= self._limit]
        if room:
            sure[others] = True
        return sure


def _place(table: SampleTable) -> NDArray[np.int64]:
    """(n,) one number for photo and pixel, in their order."""
    return table.photo.astype(np.int64) << 32 | table.pixel
