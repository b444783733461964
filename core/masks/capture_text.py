"""A copy of a capture file for another folder, with new masks."""

from __future__ import annotations

import json
import os
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

import tomlkit

from ..capture import Capture
from ..capture.model import EXCLUDED_MASKS, SHADOW_MASK
from ..capture.reader import MAX_FILE_BYTES
from ..counted import counted
from ..errors import InputError
from ..files import read_regular

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
        document = tomlkit.parse(read_regular(capture.file, MAX_FILE_BYTES).decode("utf-8-sig"))
    except (OSError, ValueError) as error:
        raise InputError(
            f"cannot be read ({error}); expected the capture file that was read before; restore it",
            file=capture.file,
        ) from error
    photos = document.get("photo", [])
    if len(photos) != len(capture.photos):
        raise InputError(
            f"found {counted(len(photos), 'photo')}; expected {len(capture.photos)} as before; "
            "run again, since the file has changed in the meantime",
            file=capture.file,
        )
    for place in PATHS:
        _redirect(document, place, capture.file.parent, folder)
    for number, photo in enumerate(photos):
        old = dict(photo.get("masks", {}))
        masks = old
        if materials is not None:
            masks = {name: file for name, file in masks.items() if name in EXCLUDED_MASKS}
            masks.update(painted[number] if number < len(painted) else {})
        if shadows is not None:
            masks = {**masks, SHADOW_MASK: shadows[number]}
        if masks == old:
            continue
        photo.pop("masks", None)
        if masks:
            photo["masks"] = tomlkit.inline_table()
            photo["masks"].update(masks)
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
    """Make the paths under the keys ``place`` relative to ``new`` instead of ``old``, in place."""
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
            data[name] = _relative_path(new, old / value)
        elif isinstance(value, list):
            data[name] = [_relative_path(new, old / v) if isinstance(v, str) else v for v in value]


def _relative_path(folder: Path, file: Path) -> str:
    """The path of a file relative to ``folder``; absolute if it is on another drive."""
    target = Path(os.path.abspath(file))
    try:
        return Path(os.path.relpath(target, folder.resolve())).as_posix()
    except ValueError:
        return target.as_posix()
