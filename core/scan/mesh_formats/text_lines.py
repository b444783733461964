"""Read numbers from the lines of a large text without a Python object for each line."""

from __future__ import annotations

import warnings
from collections.abc import Iterator
from functools import cached_property
from pathlib import Path
from typing import NoReturn

import numpy as np
from numpy.typing import NDArray

from ...errors import InputError

CHUNK_BYTES = 4 << 20  # processed together
MAX_INDENT = 64  # spaces or tabs before the first word of a line
SPACE, TAB, NEWLINE = 32, 9, 10


def text_bytes(data: bytes, path: Path) -> bytes:
    """The text with uniform line breaks. Raises InputError for UTF-16 and for binary data."""
    if data.startswith((b"\xff\xfe", b"\xfe\xff")):
        raise InputError("is UTF-16 text; save it as UTF-8", file=path)
    if b"\0" in data:
        raise InputError("is not text (it contains zero bytes); the file is damaged", file=path)
    data = data.removeprefix(b"\xef\xbb\xbf")
    if b"\r" in data and b"\n" not in data:
        data = data.replace(b"\r", b"\n")
    return data


class TextLines:
    """The lines of a text and the first visible byte of each."""

    def __init__(self, data: bytes, path: Path) -> None:
        self.data, self.path = data, path
        self.bytes = np.frombuffer(data, np.uint8)
        breaks = [
            np.flatnonzero(self.bytes[begin : begin + CHUNK_BYTES] == NEWLINE) + begin
            for begin in range(0, len(data), CHUNK_BYTES)
        ]
        ends = np.concatenate([*breaks, [len(data)]]).astype(np.int64)
        self.starts = np.concatenate([[0], ends[:-1] + 1])
        self.edges = np.append(self.starts, len(data) + 1)  # line i is edges[i] … edges[i + 1]

    @cached_property
    def first(self) -> NDArray[np.int64]:
        """(n,) offset of the first visible byte of each line; for an empty line, that of a later
        line."""
        first = self.starts.copy()
        pending = np.arange(len(first))
        for _ in range(MAX_INDENT):
            pending = pending[first[pending] < len(self.data)]
            letter = self.bytes[first[pending]]
            pending = pending[(letter == SPACE) | (letter == TAB)]
            if not len(pending):
                break
            first[pending] += 1
        return first

    def starting_with(self, word: bytes) -> NDArray[np.intp]:
        """Indices of the lines whose first word is ``word``."""
        n = len(self.data)
        found = np.arange(len(self.first))
        for k, letter in enumerate(word):
            found = found[self.first[found] + k < n]
            found = found[self.bytes[self.first[found] + k] == letter]
        after = self.first[found] + len(word)
        ended = after >= n
        blank = np.isin(self.bytes[np.minimum(after, n - 1)], (SPACE, TAB, 13, NEWLINE))
        return np.asarray(found[ended | blank])

    def line(self, number: int) -> bytes:
        """A line without its line break."""
        return self.data[self.edges[number] : self.edges[number + 1] - 1].strip()

    def chunks(
        self, lines: NDArray[np.intp], word: bytes
    ) -> Iterator[tuple[NDArray[np.intp], NDArray[np.uint8], NDArray[np.int64]]]:
        """(lines, text, edges of the lines in that text), for successive parts of ``lines``. In the
        text, ``word`` at the start of lines and all lines between are replaced with spaces."""
        begin = 0
        while begin < len(lines):
            stop = np.searchsorted(self.starts, self.starts[lines[begin]] + CHUNK_BYTES)
            end = max(int(np.searchsorted(lines, stop)), begin + 1)
            these = lines[begin:end]
            low, high = int(these[0]), int(these[-1]) + 1
            offset = int(self.edges[low])
            text = self.bytes[offset : int(self.edges[high]) - 1].copy()
            if high - low > len(these):
                wanted = np.zeros(high - low, bool)
                wanted[these - low] = True
                lengths = np.diff(self.edges[low : high + 1])
                text[~np.repeat(wanted, lengths)[: len(text)]] = SPACE
            for k in range(len(word)):
                text[self.first[these] - offset + k] = SPACE
            yield these, text, np.stack([self.edges[these], self.edges[these + 1] - 1]) - offset
            begin = end

    def floats(
        self, lines: NDArray[np.intp], word: bytes, min_count: int
    ) -> tuple[NDArray[np.float64], NDArray[np.int64]]:
        """All numbers after ``word`` in these lines, concatenated, and the number of them in each
        line (n,). Raises InputError for a line with other text or fewer than ``min_count`` numbers.
        """
        values, counts = [], []
        for these, text, edges in self.chunks(lines, word):
            visible = text > SPACE
            starts = visible.copy()
            starts[1:] &= ~visible[:-1]
            places = np.flatnonzero(starts)
            count = np.searchsorted(places, edges[1]) - np.searchsorted(places, edges[0])
            if (count < min_count).any():
                self.refuse(
                    int(these[np.argmax(count < min_count)]), f"at least {min_count} numbers"
                )
            parsed = parse_numbers(text, len(places), np.float64)
            if parsed is None:
                self._refuse_first(these, word)
            values.append(parsed)
            counts.append(count)
        if not values:
            return np.empty(0), np.empty(0, np.int64)
        return np.concatenate(values), np.concatenate(counts)

    def table(
        self, lines: NDArray[np.intp], word: bytes, columns: int
    ) -> tuple[NDArray[np.float64], NDArray[np.float64] | None]:
        """(n, columns) the first numbers of every line, and all numbers (n, k) where every line has
        the same count."""
        values, counts = self.floats(lines, word, columns)
        if not len(counts):
            return np.empty((0, columns)), None
        if (counts == counts[0]).all():
            all_values = values.reshape(len(counts), -1)
            return all_values[:, :columns], all_values
        starts = np.cumsum(counts) - counts
        return values[starts[:, None] + np.arange(columns)], None

    def refuse(self, line: int, expected: str) -> NoReturn:
        """Raise an InputError about a line."""
        found = self.line(line)[:60].decode("utf-8", "replace")
        found = "".join(c if c.isprintable() else "?" for c in found)
        raise InputError(f"found {found!r}; expected {expected}", file=self.path, line=line + 1)

    def _refuse_first(self, lines: NDArray[np.intp], word: bytes) -> NoReturn:
        for line in lines:
            try:
                for token in self.line(int(line))[len(word) :].split():
                    float(token)
            except ValueError:
                self.refuse(int(line), "numbers")
        self.refuse(int(lines[0]), "numbers (on this line or below)")


def parse_numbers(
    text: NDArray[np.uint8], count: int, dtype: type[np.float64] | type[np.int64]
) -> NDArray | None:
    """The ``count`` numbers of a text, separated by white space; None where it contains anything
    else."""
    try:
        with warnings.catch_warnings():
            warnings.simplefilter("ignore", DeprecationWarning)
            # the appended number is parsed only if all text before it was numbers
            values = np.fromstring(text.tobytes() + b" 7", dtype, count + 1, sep=" ")
    except ValueError:
        return None
    if len(values) != count + 1 or values[-1] != 7:
        return None
    return values[:-1]
