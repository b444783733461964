"""Typed access to a reconstruction tool's JSON. Each accessor checks type, length and finiteness,
and raises InputError with file and key."""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ...errors import InputError

Array = NDArray[np.float64]

MAX_EXACT_INTEGER = 1 << 53  # larger JSON numbers are not exact integers in double precision
MAX_MAGNITUDE = 1e100  # values above it are rejected: their squares may overflow a double


@dataclass(frozen=True)
class Record:
    """An object of the file. ``where``: its key path ("frames[3]"; "" for the root)."""

    values: dict[str, Any]
    file: Path
    where: str = ""

    def __contains__(self, key: str) -> bool:
        return key in self.values

    def error(self, message: str, key: str | None = None) -> InputError:
        """An InputError about a key of this object."""
        return InputError(message, file=self.file, key=self._key(key) or None)

    def number(self, key: str, default: float | None = None) -> float:
        """A finite number, also in quotes (Boost's writer quotes all numbers)."""
        value = self.values.get(key)
        if value is None and default is not None:
            return default
        number = as_number(value)
        if number is None:
            raise self.error(f"is {shown(value)}; expected a finite number", key)
        return number

    def whole(self, key: str, default: int | None = None) -> int:
        """A whole number that is not negative."""
        number = self.number(key, default)
        if number != int(number) or not 0 <= number <= MAX_EXACT_INTEGER:
            raise self.error(f"is {number:g}; expected a whole number of 0 or more", key)
        return int(number)

    def identity(self, key: str) -> str:
        """The id of an object or of a reference, whatever type it was written in; "" where it is
        missing.

        Returned as text, because ids exceed what a float represents exactly.
        """
        value = self.values.get(key)
        if value is None:
            return ""
        if isinstance(value, (bool, float, list, dict)):
            raise self.error(f"is {shown(value)}; expected an id", key)
        return str(value)[:200]

    def flag(self, key: str) -> bool:
        """A truth value, also in quotes or as a number; False where it is missing."""
        value = self.values.get(key, False)
        if isinstance(value, (list, dict)):
            raise self.error(f"is {shown(value)}; expected true or false", key)
        return value not in (False, None, 0, "", "0", "false", "False")

    def text(self, key: str, default: str | None = None) -> str:
        """A string."""
        value = self.values.get(key, default)
        if not isinstance(value, str):
            raise self.error(f"is {shown(value)}; expected text", key)
        return value

    def numbers(self, key: str, *counts: int, default: Array | None = None) -> Array:
        """(n,) finite numbers of a list, nested or not. n: one of ``counts``."""
        if key not in self.values and default is not None:
            return default
        value = self.values.get(key)
        flat = _flat(value, max(counts, default=0))
        found = [as_number(v) for v in flat]
        if not isinstance(value, list) or len(found) not in counts or None in found:
            expected = " or ".join(str(count) for count in counts)
            raise self.error(f"is {shown(value)}; expected {expected} finite numbers", key)
        return np.array(found, np.float64)

    def record(self, key: str) -> Record:
        """A nested object."""
        return self._as_record(self.values.get(key), key)

    def records(self, key: str) -> list[Record]:
        """A list of objects; empty where the key is missing or "" (Boost's empty list)."""
        value = self.values.get(key)
        if value in (None, ""):
            return []
        if not isinstance(value, list):
            raise self.error(f"is {shown(value)}; expected a list", key)
        return [self._as_record(item, f"{key}[{i}]") for i, item in enumerate(value)]

    def items(self, key: str) -> Iterator[tuple[str, Record]]:
        """(name, object) of each member of a nested object."""
        for name, value in self.record(key).values.items():
            yield name, self._as_record(value, f"{key}.{name[:60]}")

    def table(self, key: str, column: str, width: int) -> Array:
        """(n, width) the values under ``column`` of each object in a list, or in an object of
        objects; vectorised for long lists. Rows without the column are NaN."""
        value = self.values.get(key)
        if value in (None, ""):
            return np.zeros((0, width))
        rows = list(value.values()) if isinstance(value, dict) else value
        if not isinstance(rows, list):
            raise self.error(f"is {shown(value)}; expected a list", key)
        missing = [math.nan] * width
        try:
            found = [row.get(column, missing) for row in rows]
            table = np.array(found, np.float64).reshape(len(rows), -1)
        except (AttributeError, TypeError, ValueError, OverflowError) as error:
            raise self.error(f"has a {column!r} that does not hold {width} numbers", key) from error
        if table.shape[1] != width and len(rows):
            raise self.error(f"has a {column!r} that does not hold {width} numbers", key)
        return table.reshape(len(rows), width)

    def _key(self, key: str | None) -> str:
        return ".".join(part for part in (self.where, key) if part)

    def _as_record(self, value: Any, key: str) -> Record:
        if not isinstance(value, dict):
            raise self.error(f"is {shown(value)}; expected an object {{…}}", key)
        return Record(value, self.file, self._key(key))


def root_record(data: Any, file: Path) -> Record:
    """The root object of the file. Raises InputError where the root is not an object."""
    if not isinstance(data, dict):
        raise InputError(f"holds {shown(data)}; expected an object {{…}}", file=file)
    return Record(data, file)


def as_number(value: Any) -> float | None:
    """A finite float below MAX_MAGNITUDE in magnitude, or None for any other value."""
    if isinstance(value, bool) or not isinstance(value, (int, float, str)):
        return None
    if isinstance(value, str) and len(value) > 60:
        return None
    try:
        number = float(value)
    except (ValueError, OverflowError):
        return None
    return number if abs(number) < MAX_MAGNITUDE else None


def shown(value: Any) -> str:
    """A short text of a value, for messages."""
    if value is None:
        return "missing"
    if isinstance(value, list):
        return f"a list of {len(value)}"
    if isinstance(value, dict):
        return "an object"
    if isinstance(value, int) and abs(value) > MAX_EXACT_INTEGER:
        return "an integer above 2^53"
    text = repr(value)
    return text if len(text) <= 40 else text[:37] + "…"


def _flat(value: Any, max_values: int) -> list[Any]:
    """The values of a list and of the lists in it (one level), at most a few more than
    ``max_values``."""
    if not isinstance(value, list):
        return []
    flat: list[Any] = []
    for item in value[: max_values + 1]:
        flat += item[: max_values + 1] if isinstance(item, list) else [item]
        if len(flat) > max_values:
            break
    return flat
