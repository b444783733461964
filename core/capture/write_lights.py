"""Write changed lights into a capture file; only their lines change, comments are kept."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import fields, is_dataclass
from pathlib import Path
from typing import Any

import numpy as np
import tomlkit
from tomlkit.exceptions import TOMLKitError
from tomlkit.items import AoT, Table

from ..errors import InputError, PatinaError
from ..files import atomic_path
from .entries import LightEntry
from .model import Capture
from .reader import read_capture

VECTORS = ("direction", "position", "mounted")
TABLES = ("sphere", "sun", "white")


def write_lights(capture: Capture, lights: Sequence[LightEntry], out: Path) -> None:
    """Write a copy of the capture's file with ``lights`` in place of its own, one for one.

    Written are direction, position, mounted, irradiance or intensity, angle, radius, beam, guess,
    standard_error and relative_strength; the entries that these replace (sphere, sun, white) become
    comments. out may be the capture's own file. It is written atomically, after it has been read
    back and compared. Raises PatinaError.
    """
    try:
        text = capture.file.read_bytes().decode("utf-8")
    except (OSError, ValueError) as error:
        raise InputError(f"cannot be read ({error})", file=capture.file) from error
    try:
        with atomic_path(out) as partial:
            partial.write_bytes(with_lights(text, capture, lights).encode("utf-8"))
            _check(partial, capture, lights, out)
    except OSError as error:
        raise InputError(f"cannot be written ({error.strerror or error})", file=out) from error


def with_lights(text: str, capture: Capture, lights: Sequence[LightEntry]) -> str:
    """The text of the capture's file with ``lights`` in place of its own. Raises InputError where a
    light that changes is not a [[light]] table of its own."""
    changes = {
        place: values
        for place, (old, new) in enumerate(zip(capture.lights, lights, strict=True))
        if (values := _changes(old, new))
    }
    if not changes:
        return text
    mark, body = ("\ufeff", text[1:]) if text.startswith("\ufeff") else ("", text)
    try:
        document = tomlkit.parse(body)
    except TOMLKitError as error:
        raise InputError(f"cannot be edited ({error})", file=capture.file) from error
    tables = document.get("light")
    if not isinstance(tables, AoT):
        raise capture.error(
            "is written inside another value; expected a [[light]] table of its own: "
            "rewrite it so, then save again", "light", min(changes),
        )  # fmt: skip
    for place, values in changes.items():
        for key, value in values.items():
            if value is not None:
                _set(tables[place], key, value, "\r\n" if "\r\n" in body else "\n")
    before = document.as_string()
    for place, values in changes.items():
        for key in [key for key, value in values.items() if value is None]:
            tables[place].remove(key)
    return mark + _commented(before, document.as_string())


def _set(table: Table, key: str, value: str, line_break: str) -> None:
    """Give a key of a table another value, as TOML; a new key follows the keys that are there."""
    item = tomlkit.value(value)
    if key in table:
        table[key] = item
        return
    own = next((i for k, i in table.value.body if k is not None and k.key == "name"), None)
    item.trivia.indent = own.trivia.indent if own is not None else ""
    item.trivia.trail = line_break
    table.append(key, item)


def _commented(before: str, after: str) -> str:
    """``before`` with the lines that are missing in ``after`` as comments."""
    kept = after.splitlines(keepends=True)
    lines, place = [], 0
    for line in before.splitlines(keepends=True):
        stays = place < len(kept) and kept[place] == line
        place += stays
        lines.append(line if stays or not line.strip() else f"# {line}")
    return "".join(lines)


def _changes(old: LightEntry, new: LightEntry) -> dict[str, str | None]:
    """{key: new value as TOML, None to remove it}."""
    strength = "irradiance" if new.distant else "intensity"
    pairs = {key: (getattr(old, key), getattr(new, key)) for key in VECTORS}
    pairs[strength] = (old.strength, new.strength)
    changes: dict[str, str | None] = {
        key: None if after is None else f"[{', '.join(repr(float(x)) for x in after)}]"
        for key, (before, after) in pairs.items()
        if not _same(before, after)
    }
    if not _same(old.angle, new.angle):
        changes["angle"] = None if new.angle is None else repr(float(np.degrees(new.angle)))
    if not _same(old.beam, new.beam):
        changes["beam"] = None if new.beam is None else repr(float(np.degrees(new.beam)))
    if not _same(old.radius, new.radius):
        changes["radius"] = repr(float(new.radius))
    if old.guess != new.guess:
        changes["guess"] = "true" if new.guess else None
    if not _same(old.standard_error, new.standard_error):
        changes["standard_error"] = _standard_error(new)
    if not _same(old.relative_strength, new.relative_strength):
        relative = new.relative_strength
        changes["relative_strength"] = None if relative is None else repr(float(relative))
    for key in TABLES:
        if getattr(old, key) is not None and getattr(new, key) is None:
            changes[key] = None
    return changes


def _standard_error(entry: LightEntry) -> str | None:
    error = entry.standard_error
    if error is None:
        return None
    return repr(float(np.degrees(error) if entry.distant else error))


def _check(partial: Path, capture: Capture, lights: Sequence[LightEntry], out: Path) -> None:
    """Raise PatinaError where the written file does not read back as intended."""
    where = f"its paths are relative to {capture.file.parent}; save it in that folder"
    try:
        back = read_capture(partial)
    except InputError as error:
        elsewhere = out.resolve().parent != capture.file.parent
        why = where if elsewhere else f"reading it back fails: {error}"
        raise InputError(f"cannot be saved here; {why}", file=out) from error
    for part in ("scan", "tone", "photos", "materials", "fit"):
        if not _same(getattr(back, part), getattr(capture, part)):
            raise InputError(f"cannot be saved here; {where}", file=out)
    if not _same(back.lights, tuple(lights)):
        raise PatinaError(
            f"{capture.file}: the lights cannot be changed in this text; expected a [[light]] "
            "table for each light, with one key per line"
        )


def _same(one: Any, other: Any) -> bool:
    """Equality with a tolerance for rounding of numbers; paths are compared after resolving."""
    if type(one) is not type(other) and not (
        isinstance(one, int | float) and isinstance(other, int | float)
    ):
        return False
    if is_dataclass(one):
        return all(_same(getattr(one, f.name), getattr(other, f.name)) for f in fields(one))
    if isinstance(one, list | tuple):
        return len(one) == len(other) and all(map(_same, one, other))
    if isinstance(one, dict):
        return one.keys() == other.keys() and all(_same(one[key], other[key]) for key in one)
    if isinstance(one, Path):
        return one.resolve() == other.resolve()
    if isinstance(one, np.ndarray):
        return one.shape == other.shape and bool(np.allclose(one, other, rtol=1e-12, atol=1e-15))
    if isinstance(one, float):
        return bool(np.isclose(one, other, rtol=1e-12, atol=1e-15))
    return bool(one == other)
