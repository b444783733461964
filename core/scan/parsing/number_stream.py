"""Read large text files of numbers in pieces, so that memory is bounded whatever counts they
declare."""

from __future__ import annotations

import warnings
from pathlib import Path
from types import TracebackType
from typing import BinaryIO

import numpy as np
from numpy.typing import NDArray

from ...errors import InputError
from ...files import regular_size

Array = NDArray[np.float64]

MAX_FILE_BYTES = 1 << 31
PIECE_BYTES = 1 << 23  # parsed at once
MAX_LINE_BYTES = 1 << 20  # longer than a point that a million photos observe


class NumberStream:
    """A text file, read line by line or number by number. A context manager.

    Raises InputError (with the line, where known) where data is missing or not a number.
    """

    def __init__(self, path: Path) -> None:
        self.path = path
        self.line = 0  # number of the last line read
        self._rest = np.zeros(0)
        try:
            self.size = regular_size(path)
            self._file: BinaryIO = path.open("rb")
        except OSError as error:
            raise InputError(f"cannot be read ({error.strerror})", file=path) from error
        if self.size > MAX_FILE_BYTES:
            self._file.close()
            raise InputError(f"is too large ({self.size:,} bytes)", file=path)

    def __enter__(self) -> NumberStream:
        return self

    def __exit__(
        self,
        kind: type[BaseException] | None,
        error: BaseException | None,
        trace: TracebackType | None,
    ) -> None:
        self._file.close()

    def error(self, message: str) -> InputError:
        """An InputError about the last line read."""
        return InputError(message, file=self.path, line=self.line or None)

    def text_line(self) -> str | None:
        """The next line that is not empty, stripped; None at the end of the file."""
        while True:
            raw = self._raw_line()
            if not raw:
                return None
            try:
                text = raw.decode("utf-8-sig" if self.line == 1 else "utf-8").strip()
            except UnicodeDecodeError:
                text = raw.decode(
                    "cp1252", "replace"
                ).strip()  # file names written by a Windows tool
            if "\0" in text:
                raise self.error("is not a text file")
            if text:
                return text

    def count(self, what: str, min_bytes: int) -> int:
        """The count in the next line. Each counted item takes at least ``min_bytes`` bytes."""
        text = self.text_line()
        if text is None or not text.isascii() or not text.isdigit() or len(text) > 18:
            raise self.error(f"found {_shown(text)}; expected the number of {what}")
        return self.bounded(int(text), what, min_bytes)

    def bounded(self, count: float, what: str, min_bytes: int) -> int:
        """The count as an integer. Raises InputError where the file is too small for it."""
        if not (0 <= count < 1e18 and count == int(count)):
            raise self.error(f"found {count:g}; expected the number of {what}")
        if count * min_bytes > self.size:
            raise self.error(
                f"declares {count:,.0f} {what}, more than fit into its {self.size:,} bytes"
            )
        return int(count)

    def lines_of_numbers(self, count: int) -> tuple[Array, int]:
        """(numbers of the next lines, number of lines): at most ``count`` lines and about
        PIECE_BYTES bytes."""
        lines: list[bytes] = []
        total = 0
        while len(lines) < count and total < PIECE_BYTES:
            raw = self._raw_line()
            if not raw:
                break
            if raw.strip():
                lines.append(raw)
                total += len(raw)
        return self._parsed(b"".join(lines)), len(lines)

    def take(self, count: int) -> Array:
        """The next ``count`` numbers, across line breaks."""
        parts, have = [self._rest], len(self._rest)
        while have < count:
            piece = self._piece()
            if not len(piece):
                raise self.error(f"ends early; expected {count - have:,} more numbers")
            parts.append(piece)
            have += len(piece)
        values = np.concatenate(parts) if len(parts) > 1 else self._rest
        self._rest = values[count:]
        return values[:count]

    def available(self) -> Array:
        """Numbers that were read and not taken yet. Where there are none, reads another piece
        (empty at the end of the file)."""
        if not len(self._rest):
            self._rest = self._piece()
        return self._rest

    def more(self) -> bool:
        """Read another piece after those available; False at the end of the file."""
        piece = self._piece()
        self._rest = np.concatenate([self._rest, piece])
        return bool(len(piece))

    def _piece(self) -> Array:
        lines: list[bytes] = []
        total = 0
        while total < PIECE_BYTES:
            raw = self._raw_line()
            if not raw:
                break
            lines.append(raw)
            total += len(raw)
        values = self._parsed(b"".join(lines))
        # a piece of blank lines only is not the end of the file
        return values if len(values) or not lines else self._piece()

    def _raw_line(self) -> bytes:
        raw = self._file.readline(MAX_LINE_BYTES + 1)
        self.line += bool(raw)
        if len(raw) > MAX_LINE_BYTES:
            raise self.error(
                "has a line of more than 1 MiB, which is too long for a file of this kind"
            )
        return raw

    def _parsed(self, text: bytes) -> Array:
        if not text.strip():
            return np.zeros(0)
        with warnings.catch_warnings():
            # for invalid numbers numpy stops and only gives this warning
            warnings.simplefilter("error", DeprecationWarning)
            try:
                values = np.fromstring(text, np.float64, sep=" ")
            except (DeprecationWarning, ValueError) as error:
                raise self.error("has text that is not a number, on this line or above") from error
        return values


def _shown(text: str | None) -> str:
    if text is None:
        return "nothing (the file ends early)"
    return repr(text if len(text) <= 40 else text[:37] + "…")
