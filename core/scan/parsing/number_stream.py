"""Large text files of numbers, read in pieces: memory stays bounded whatever they claim to hold."""

from __future__ import annotations

import warnings
from pathlib import Path
from types import TracebackType
from typing import BinaryIO

import numpy as np
from numpy.typing import NDArray

from ...errors import InputError

Array = NDArray[np.float64]

LARGEST = 1 << 31  # bytes of a file
PIECE = 1 << 23  # bytes that are parsed at once
LONGEST_LINE = 1 << 20  # bytes; a point of a million photos


class NumberStream:
    """A text file, taken line by line or number by number. A context manager.

    Raises InputError (with the line, where known) for what is not there or no number.
    """

    def __init__(self, path: Path) -> None:
        self.path = path
        self.line = 0  # the last one read
        self._rest = np.zeros(0)
        try:
            self.size = path.stat().st_size
            self._file: BinaryIO = path.open("rb")
        except OSError as error:
            raise InputError(f"cannot be read ({error.strerror})", file=path) from error
        if self.size > LARGEST:
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
        """The next line that is not empty, stripped; None at the file's end."""
        while True:
            raw = self._raw_line()
            if not raw:
                return None
            try:
                text = raw.decode("utf-8-sig" if self.line == 1 else "utf-8").strip()
            except UnicodeDecodeError:
                text = raw.decode("cp1252", "replace").strip()  # a Windows tool's file names
            if "\0" in text:
                raise self.error("is not a text file")
            if text:
                return text

    def count(self, what: str, smallest: int) -> int:
        """A number of things that the next line holds; each takes ``smallest`` bytes or more."""
        text = self.text_line()
        if text is None or not text.isascii() or not text.isdigit() or len(text) > 18:
            raise self.error(f"{_shown(text)} is not a number of {what}")
        return self.bounded(int(text), what, smallest)

    def bounded(self, count: float, what: str, smallest: int) -> int:
        """A count the file is large enough for, or an InputError."""
        if not (0 <= count < 1e18 and count == int(count)):
            raise self.error(f"{count:g} is not a number of {what}")
        if count * smallest > self.size:
            raise self.error(
                f"says it holds {count:,.0f} {what}, more than fit into its {self.size:,} bytes"
            )
        return int(count)

    def lines_of_numbers(self, count: int) -> tuple[Array, int]:
        """(the numbers of the next lines, how many lines): ``count`` lines at most, about PIECE
        bytes at most."""
        lines: list[bytes] = []
        total = 0
        while len(lines) < count and total < PIECE:
            raw = self._raw_line()
            if not raw:
                break
            if raw.strip():
                lines.append(raw)
                total += len(raw)
        return self._parsed(b"".join(lines)), len(lines)

    def take(self, count: int) -> Array:
        """The next ``count`` numbers, whatever lines they are on."""
        parts, have = [self._rest], len(self._rest)
        while have < count:
            piece = self._piece()
            if not len(piece):
                raise self.error(f"ends early: {count - have:,} more numbers were expected")
            parts.append(piece)
            have += len(piece)
        values = np.concatenate(parts) if len(parts) > 1 else self._rest
        self._rest = values[count:]
        return values[:count]

    def available(self) -> Array:
        """Numbers that were read and not taken yet; a further piece of them where there are none
        (empty at the file's end)."""
        if not len(self._rest):
            self._rest = self._piece()
        return self._rest

    def more(self) -> bool:
        """Read one more piece behind those available; False at the file's end."""
        piece = self._piece()
        self._rest = np.concatenate([self._rest, piece])
        return bool(len(piece))

    def _piece(self) -> Array:
        lines: list[bytes] = []
        total = 0
        while total < PIECE:
            raw = self._raw_line()
            if not raw:
                break
            lines.append(raw)
            total += len(raw)
        values = self._parsed(b"".join(lines))
        # blank lines to the end of the piece are not the end of the file
        return values if len(values) or not lines else self._piece()

    def _raw_line(self) -> bytes:
        raw = self._file.readline(LONGEST_LINE + 1)
        self.line += bool(raw)
        if len(raw) > LONGEST_LINE:
            raise self.error("has a line that is too long for a file of this kind")
        return raw

    def _parsed(self, text: bytes) -> Array:
        if not text.strip():
            return np.zeros(0)
        with warnings.catch_warnings():
            # numpy stops at what is no number, with this warning only
            warnings.simplefilter("error", DeprecationWarning)
            try:
                values = np.fromstring(text, np.float64, sep=" ")
            except (DeprecationWarning, ValueError) as error:
                raise self.error("has something in or above this line that is no number") from error
        return values


def _shown(text: str | None) -> str:
    if text is None:
        return "nothing (the file ends early)"
    return repr(text if len(text) <= 40 else text[:37] + "…")
