"""One table of a capture file, read key by key; keys that were not read are reported as unknown."""

from __future__ import annotations

import math
from collections.abc import Iterator
from datetime import date
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ..errors import InputError
from .model import key_error

MAX_COMPONENT = 1e12  # of a direction or an irradiance


class Section:
    """A table and its position in the file. Reading a key marks it as known; close() raises
    InputError for keys that were not read."""

    def __init__(
        self,
        data: dict[str, Any],
        file: Path,
        lines: dict[tuple[str | int, ...], int],
        path: tuple[str | int, ...] = (),
    ) -> None:
        self.data, self.file, self.lines, self.path = data, file, lines, path
        self.known: set[str] = set()

    def error(self, message: str, *key: str | int) -> InputError:
        """An InputError that names the file, the key in this table and its line."""
        return key_error(self.file, self.lines, message, *self.path, *key)

    def get(self, name: str, required: bool = False) -> Any:
        """The value of a key as TOML has it, None where it is absent. Raises InputError for a
        missing required key."""
        self.known.add(name)
        if required and name not in self.data:
            raise self.error(f"the key {name!r} is missing; add it", name)
        return self.data.get(name)

    def __contains__(self, name: str) -> bool:
        return name in self.data

    def text(self, name: str) -> str:
        """A required non-empty string."""
        value = self.get(name, required=True)
        if not isinstance(value, str) or not value:
            raise self.error(f"found {shown(value)}; expected a text", name)
        return value

    def optional_text(self, name: str) -> str | None:
        """A non-empty string, or None where the key is absent."""
        return None if self.get(name) is None else self.text(name)

    def file_path(self, name: str) -> Path:
        """An existing file or folder; a relative path is relative to the capture file."""
        return self.path_of(self.text(name), name)

    def path_of(self, value: Any, name: str) -> Path:
        """The same for one value of the key ``name``."""
        if not isinstance(value, str) or not value:
            raise self.error(f"found {shown(value)}; expected a text", name)
        path = Path(value)
        path = path if path.is_absolute() else self.file.parent / path
        try:
            there = path.exists()
        except (OSError, ValueError):  # a name too long for any file, or with a NUL in it
            there = False
        if not there:
            raise self.error(f"no such file: {shortened(path)}; check the path", name)
        return path

    def optional_file_path(self, name: str) -> Path | None:
        """The same, or None where the key is absent."""
        return None if self.get(name) is None else self.file_path(name)

    def number(
        self, name: str, default: float, low: float = -math.inf, high: float = math.inf
    ) -> float:
        """A finite number from ``low`` to ``high``, or ``default`` where the key is absent."""
        value = self.get(name)
        if value is None:
            return default
        if isinstance(value, bool) or not isinstance(value, int | float):
            raise self.error(f"found {shown(value)}; expected a number", name)
        if isinstance(value, int) and abs(value) > 1e300:  # too large for a float
            raise self.error(f"expected a number from {low:g} to {high:g}", name)
        if not (math.isfinite(value) and low <= value <= high):
            raise self.error(f"found {value}; expected a number from {low:g} to {high:g}", name)
        return float(value)

    def optional_number(self, name: str, low: float, high: float) -> float | None:
        """A finite number from ``low`` to ``high``, or None where the key is absent."""
        return None if self.get(name) is None else self.number(name, low, low, high)

    def integer(self, name: str, default: int, low: int, high: int = 2**31) -> int:
        """A whole number from ``low`` to ``high``, or ``default`` where the key is absent."""
        value = self.get(name)
        if value is None:
            return default
        if isinstance(value, bool) or not isinstance(value, int) or not low <= value <= high:
            raise self.error(
                f"found {shown(value)}; expected a whole number from {low} to {high}", name
            )
        return value

    def flag(self, name: str, default: bool) -> bool:
        """A boolean, or ``default`` where the key is absent."""
        value = self.get(name)
        if value is None:
            return default
        if not isinstance(value, bool):
            raise self.error(f"found {shown(value)}; expected true or false", name)
        return value

    def vector(self, name: str, parts: str = "x, y, z") -> NDArray[np.float64] | None:
        """Three finite numbers, or None where the key is absent."""
        value = self.get(name)
        if value is None:
            return None
        good = (
            isinstance(value, list)
            and len(value) == 3
            and all(isinstance(x, int | float) and not isinstance(x, bool) for x in value)
            and all(abs(x) <= MAX_COMPONENT for x in value)  # false for NaN too
        )
        if not good:
            found = shown(value)
            raise self.error(f"found {found}; expected three numbers [{parts}]", name)
        return np.array(value, np.float64)

    def numbers(self, name: str, count: int) -> NDArray[np.float64] | None:
        """(count,) finite numbers, or None where the key is absent."""
        found = self.number_list(name, count, count)
        return None if found is None else np.array(found)

    def number_list(self, name: str, min_count: int, max_count: int) -> tuple[float, ...] | None:
        """From ``min_count`` to ``max_count`` finite numbers, or None where the key is absent."""
        value = self.get(name)
        if value is None:
            return None
        if not (
            isinstance(value, list) and min_count <= len(value) <= max_count and _finite(value)
        ):
            expected = str(min_count) if min_count == max_count else f"{min_count} to {max_count}"
            raise self.error(f"expected {expected} numbers", name)
        return tuple(float(x) for x in value)

    def points(self, name: str, count: int) -> NDArray[np.float64]:
        """(count, 2) pixel coordinates; the key is required."""
        value = self.get(name, required=True)
        good = (
            isinstance(value, list)
            and len(value) == count
            and all(isinstance(p, list) and len(p) == 2 and _finite(p) for p in value)
        )
        if not good:
            raise self.error(f"expected {count} points [[x, y], …] in pixels", name)
        return np.array(value, np.float64)

    def table(self, name: str) -> Section:
        """A sub-table; an empty one where the key is absent."""
        value = self.get(name)
        if value is None:
            value = {}
        if not isinstance(value, dict):
            raise self.error(f"found {shown(value)}; expected a table", name)
        return Section(value, self.file, self.lines, (*self.path, name))

    def tables(self, name: str) -> Iterator[Section]:
        """The tables of an array of tables; none where the key is absent."""
        value = self.get(name)
        if value is None:
            value = []
        if not isinstance(value, list) or not all(isinstance(v, dict) for v in value):
            raise self.error(f"expected [[{name}]] tables", name)
        for place, entry in enumerate(value):
            yield Section(entry, self.file, self.lines, (*self.path, name, place))

    def close(self) -> None:
        """Raise InputError for a key that was not read."""
        for name in self.data:
            if name not in self.known:
                known = ", ".join(sorted(self.known))
                raise self.error(f"unknown key {name!r}; expected one of: {known}", name)


def _finite(values: list[Any]) -> bool:
    return all(
        isinstance(x, int | float) and not isinstance(x, bool) and abs(x) <= MAX_COMPONENT
        for x in values
    )


def shown(value: Any) -> str:
    """A value as short text for a message. Python raises ValueError for huge integers."""
    try:
        text = str(value) if isinstance(value, date) else repr(value)
    except ValueError:
        return "a number too large"
    return text if len(text) < 100 else f"{text[:60]} …"


def shortened(path: Path) -> str:
    """The path for a message; only the end of a long one."""
    text = str(path)
    return text if len(text) <= 300 else f"…{text[-300:]}"
