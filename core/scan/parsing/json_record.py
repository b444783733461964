"""JSON of a reconstruction tool, asked for what it should hold: each answer is of the type, the
length and the finiteness expected, or an InputError that names file and key."""

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

LARGEST_WHOLE = 1 << 53  # beyond it a JSON number is no exact integer
BEYOND = 1e100  # no tool writes such a number; its square would be beyond floats


@dataclass(frozen=True)
class Record:
    """An object of the file: ``where`` says which ("frames[3]"; "" for the file itself)."""

    values: dict[str, Any]
    file: Path
    where: str = ""

    def __contains__(self, key: str) -> bool:
        return key in self.values

    def error(self, message: str, key: str | None = None) -> InputError:
        """An InputError about a key of this object."""
        return InputError(message, file=self.file, key=self._key(key) or None)

    def number(self, key: str, default: float | None = None) -> float:
        """A finite number; one in quotes too (Boost's writer quotes all of them)."""
        value = self.values.get(key)
        if value is None and default is not None:
            return default
        number = as_number(value)
        if number is None:
            raise self.error(f"is {shown(value)}; expected a finite number", key)
        return number

    def whole(self, key: str, default: int | None = None) -> int:
        """A whole number, not negative."""
        number = self.number(key, default)
        if number != int(number) or not 0 <= number <= LARGEST_WHOLE:
            raise self.error(f"is {number:g}; expected a whole number, not negative", key)
        return int(number)

    def identity(self, key: str) -> str:
        """What another object refers to this one by, in whatever type it was written; "" without.

        As text, because ids go beyond what a float can tell apart.
        """
        value = self.values.get(key)
        if value is None:
            return ""
        if isinstance(value, (bool, float, list, dict)):
            raise self.error(f"is {shown(value)}; expected an id", key)
        return str(value)[:200]

    def flag(self, key: str) -> bool:
        """A truth value, in quotes or as a number too; False where it is missing."""
        value = self.values.get(key, False)
        if isinstance(value, (list, dict)):
            raise self.error(f"is {shown(value)}; expected true or false", key)
        return value not in (False, None, 0, "", "0", "false", "False")

    def text(self, key: str, default: str | None = None) -> str:
        """A text."""
        value = self.values.get(key, default)
        if not isinstance(value, str):
            raise self.error(f"is {shown(value)}; expected a text", key)
        return value

    def numbers(self, key: str, *counts: int, default: Array | None = None) -> Array:
        """Finite numbers in a list, nested or not, as many as one of ``counts``; flat."""
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
        """An object within this one."""
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
        """Objects by name."""
        for name, value in self.record(key).values.items():
            yield name, self._as_record(value, f"{key}.{name[:60]}")

    def table(self, key: str, column: str, width: int) -> Array:
        """(n, width) what each object of a list, or of an object of objects, says under
        ``column``: for the many. NaN rows where one says nothing."""
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
            raise self.error(f"has a {column!r} that is not {width} numbers", key) from error
        if table.shape[1] != width and len(rows):
            raise self.error(f"has a {column!r} that is not {width} numbers", key)
        return table.reshape(len(rows), width)

    def _key(self, key: str | None) -> str:
        return ".".join(part for part in (self.where, key) if part)

    def _as_record(self, value: Any, key: str) -> Record:
        if not isinstance(value, dict):
            raise self.error(f"is {shown(value)}; expected an object {{…}}", key)
        return Record(value, self.file, self._key(key))


def root_record(data: Any, file: Path) -> Record:
    """The file's outermost object. Raises InputError where it is none."""
    if not isinstance(data, dict):
        raise InputError(f"holds {shown(data)}; expected an object {{…}}", file=file)
    return Record(data, file)


def as_number(value: Any) -> float | None:
    """A finite float (of sane size), or None for what is none."""
    if isinstance(value, bool) or not isinstance(value, (int, float, str)):
        return None
    if isinstance(value, str) and len(value) > 60:
        return None
    try:
        number = float(value)
    except (ValueError, OverflowError):
        return None
    return number if abs(number) < BEYOND else None


def shown(value: Any) -> str:
    """A value as a message can show it."""
    if value is None:
        return "missing"
    if isinstance(value, list):
        return f"a list of {len(value)}"
    if isinstance(value, dict):
        return "an object"
    if isinstance(value, int) and abs(value) > LARGEST_WHOLE:
        return "a huge number"
    text = repr(value)
    return text if len(text) <= 40 else text[:37] + "…"


def _flat(value: Any, most: int) -> list[Any]:
    """The values of a list, and of lists in it (never deeper), a few more than ``most`` at most."""
    if not isinstance(value, list):
        return []
    flat: list[Any] = []
    for item in value[: most + 1]:
        flat += item[: most + 1] if isinstance(item, list) else [item]
        if len(flat) > most:
            break
    return flat
