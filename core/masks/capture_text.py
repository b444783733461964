"""A capture file written anew: the same capture from another folder, with other masks."""

from __future__ import annotations

import json
import os
import re
import tomllib
from collections.abc import Mapping, Sequence
from datetime import date, datetime, time
from pathlib import Path
from typing import Any

from ..capture import Capture
from ..capture.model import LEFT_OUT, SHADOW_MASK
from ..errors import InputError

BARE_KEY = re.compile(r"[A-Za-z0-9_-]+")
# where a capture file names files: what the reader calls file_path
PLACES: tuple[tuple[str, ...], ...] = (
    ("scan", "cameras"),
    ("scan", "mesh"),
    ("scan", "images"),
    ("scan", "extra"),
    ("scan", "texture"),
    ("tone", "chart", "photo"),
    ("light", "sphere", "photo"),
    ("light", "sphere", "mask"),
    ("light", "white", "photo"),
    ("light", "white", "mask"),
    ("photo", "file"),
    ("photo", "masks", "*"),
)


def capture_with_masks(
    capture: Capture,
    folder: Path,
    shadows: Sequence[str] | None,
    materials: Sequence[str] | None,
    painted: Sequence[Mapping[str, str]] = (),
) -> str:
    """The capture's file as TOML for ``folder``: paths lead to the same files, masks are new.

    shadows: one mask file a photo, relative to ``folder``; None: those of the capture stay.
    materials: names that replace the capture's materials (masks by their names included), painted:
    {name: mask file} of each photo; None: they stay. Comments of the old file are not kept.
    Raises InputError where the file has changed into something else meanwhile.
    """
    try:
        data = tomllib.loads(capture.file.read_text("utf-8-sig"))
    except (OSError, ValueError) as error:
        raise InputError(f"is gone or not a capture file any more ({error})", file=capture.file) \
            from error  # fmt: skip
    photos = data.get("photo", [])
    if len(photos) != len(capture.photos):
        raise InputError("has changed while it was worked on", file=capture.file)
    for place in PLACES:
        _redirect(data, place, capture.file.parent, folder)
    for number, photo in enumerate(photos):
        masks = dict(photo.get("masks", {}))
        if materials is not None:
            masks = {name: file for name, file in masks.items() if name in LEFT_OUT}
            masks.update(painted[number] if number < len(painted) else {})
        if shadows is not None:
            masks[SHADOW_MASK] = shadows[number]
        photo.pop("masks", None)
        if masks:
            photo["masks"] = masks
    if materials is not None:
        data.pop("material", None)
        data["material"] = [{"name": name} for name in materials]
    name = json.dumps(capture.file.name, ensure_ascii=False)
    head = f"# {name}, with masks that Patina proposes."
    return "\n".join([head, *_document(data)]) + "\n"


def _redirect(data: Any, place: tuple[str, ...], old: Path, new: Path) -> None:
    """Change the paths at ``place`` from relative to ``old`` into relative to ``new``."""
    if isinstance(data, list):
        for entry in data:
            _redirect(entry, place, old, new)
        return
    if not isinstance(data, dict):
        return
    key, *rest = place
    for name in [*data] if key == "*" else [key]:
        if name not in data:
            continue
        value = data[name]
        if rest:
            _redirect(value, tuple(rest), old, new)
        elif isinstance(value, str):
            data[name] = _seen_from(new, old / value)
        elif isinstance(value, list):
            data[name] = [_seen_from(new, old / v) if isinstance(v, str) else v for v in value]


def _seen_from(folder: Path, file: Path) -> str:
    """Relative where there is a way from the one to the other; on another drive, absolute."""
    target = Path(os.path.abspath(file))
    try:
        return Path(os.path.relpath(target, folder.resolve())).as_posix()
    except ValueError:
        return target.as_posix()


def _document(data: Mapping[str, Any]) -> list[str]:
    """Lines of TOML: plain keys, then tables, then arrays of tables (https://toml.io/en/v1.0.0)."""
    lines = [f"{_key(k)} = {_value(v)}" for k, v in data.items() if not _is_table(v)]
    for name, value in data.items():
        if isinstance(value, dict):
            lines += ["", f"[{_key(name)}]"]
            lines += [f"{_key(k)} = {_value(v)}" for k, v in value.items()]
        elif _is_table(value):
            for entry in value:
                lines += ["", f"[[{_key(name)}]]"]
                lines += [f"{_key(k)} = {_value(v)}" for k, v in entry.items()]
    return lines


def _is_table(value: Any) -> bool:
    tables = isinstance(value, list) and value and all(isinstance(v, dict) for v in value)
    return isinstance(value, dict) or bool(tables)


def _key(name: str) -> str:
    return name if BARE_KEY.fullmatch(name) else _text(name)


def _text(value: str) -> str:
    # JSON escapes as TOML does, but for the control character DEL
    return json.dumps(value, ensure_ascii=False).replace("\x7f", "\\u007f")


def _value(value: Any) -> str:
    if isinstance(value, bool):
        return "true" if value else "false"
    if isinstance(value, str):
        return _text(value)
    if isinstance(value, int):
        return str(value)
    if isinstance(value, float):
        return repr(value)  # inf and nan are written so in TOML too
    if isinstance(value, datetime | date | time):
        return value.isoformat()
    if isinstance(value, list):
        return "[" + ", ".join(_value(v) for v in value) + "]"
    if isinstance(value, dict):
        return "{" + ", ".join(f"{_key(k)} = {_value(v)}" for k, v in value.items()) + "}"
    raise TypeError(f"no TOML for a {type(value).__name__}")
