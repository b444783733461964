"""A capture file written anew: the same capture from another folder, with other masks."""

from __future__ import annotations

import json
import os
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

import tomlkit

from ..capture import Capture
from ..capture.model import LEFT_OUT, SHADOW_MASK
from ..errors import InputError

PATHS: tuple[tuple[str, ...], ...] = (
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
"""Keys of a capture file that name files; "*": any key."""


def capture_with_masks(
    capture: Capture,
    folder: Path,
    shadows: Sequence[str] | None,
    materials: Sequence[str] | None,
    painted: Sequence[Mapping[str, str]] = (),
) -> str:
    """The capture's file as TOML for ``folder``: paths lead to the same files, masks are new, and
    comments stay.

    shadows: one mask file a photo, relative to ``folder``; None: those of the capture stay.
    materials: names that replace the capture's materials and the masks named after them, painted:
    {name: mask file} of each photo; None: they stay. Raises InputError where the file has changed
    meanwhile.
    """
    try:
        document = tomlkit.parse(capture.file.read_text("utf-8-sig"))
    except (OSError, ValueError) as error:
        raise InputError(f"is gone or no longer a capture file ({error})", file=capture.file) \
            from error  # fmt: skip
    photos = document.get("photo", [])
    if len(photos) != len(capture.photos):
        raise InputError("has changed meanwhile: start again", file=capture.file)
    for place in PATHS:
        _redirect(document, place, capture.file.parent, folder)
    for number, photo in enumerate(photos):
        old = dict(photo.get("masks", {}))
        masks = old
        if materials is not None:
            masks = {name: file for name, file in masks.items() if name in LEFT_OUT}
            masks.update(painted[number] if number < len(painted) else {})
        if shadows is not None:
            masks = {**masks, SHADOW_MASK: shadows[number]}
        if masks == old:
            continue
        photo.pop("masks", None)
        if masks:
            table = tomlkit.inline_table()
            table.update(masks)
            photo["masks"] = table
    if materials is not None:
        document.pop("material", None)
        tables = tomlkit.aot()
        for name in materials:
            table = tomlkit.table()
            table["name"] = name
            tables.append(table)
        document["material"] = tables
    name = json.dumps(capture.file.name, ensure_ascii=False)
    return f"# {name}, with masks that Patina proposes.\n{document.as_string()}"


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
