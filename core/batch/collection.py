"""The objects of a collection: from a folder, a list or a table."""

from __future__ import annotations

import csv
import re
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

from ..errors import InputError
from ..files import as_file_name, read_regular

CAPTURES = "*.capture.toml"
TABLES = {".csv": ",", ".tsv": "\t"}  # suffix → separator
MAX_LIST_BYTES = 1 << 26  # a million lines
MAX_NAME = 120  # characters, of a folder's name
COLUMNS = ("capture", "name", "session")


@dataclass(frozen=True)
class Item:
    """One object. name: of its folder of results, unique; capture: its capture file; session: of
    one rig, for causes that several objects have in common ("" if not stated)."""

    name: str
    capture: Path
    session: str = ""


def read_collection(path: Path) -> tuple[Item, ...]:
    """The objects of a collection, sorted by name. path: a folder that is searched for captures; a
    table (CSV or TSV) with a column ``capture``, and optionally ``name`` and ``session``; or a text
    file with the path of one capture on each line. Paths are relative to the file. Raises
    InputError.
    """
    if path.is_dir():
        found = [(one, one.parent.relative_to(path), "", "") for one in path.rglob(CAPTURES)]
        items = [
            (file, name or _name_in(folder, file, path), session)
            for file, folder, name, session in found
        ]
    elif path.suffix.lower() in TABLES:
        items = list(_table(path))
    else:
        items = [(path.parent / line, "", "") for line in _lines(path)]
    if not items:
        raise InputError(f"holds no captures; expected files {CAPTURES}", file=path)
    made = [Item(name or _stem(file), file.resolve(), session) for file, name, session in items]
    return _unique(made, path)


def _lines(path: Path) -> list[str]:
    """The lines of a list that are neither empty nor comments."""
    lines = (line.strip() for line in _text(path).splitlines())
    return [line for line in lines if line and not line.startswith("#")]


def _text(path: Path) -> str:
    """The text of a list or table; spreadsheets write a mark before it."""
    return read_regular(path, MAX_LIST_BYTES).decode("utf-8-sig", "replace")


def _table(path: Path) -> Iterator[tuple[Path, str, str]]:
    lines = [line for line in _text(path).splitlines() if line.strip()]
    rows = csv.DictReader(lines, delimiter=TABLES[path.suffix.lower()])
    if "capture" not in (rows.fieldnames or ()):
        raise InputError(
            f"has the columns {', '.join(rows.fieldnames or ()) or 'none'}; expected "
            f"{', '.join(COLUMNS)}, of which the first is required",
            file=path,
        )
    for number, row in enumerate(rows, 2):
        if not row["capture"]:
            raise InputError(f"line {number} names no capture", file=path)
        yield path.parent / row["capture"], row.get("name") or "", row.get("session") or ""


def _name_in(folder: Path, file: Path, top: Path) -> str:
    """The name of an object in a folder of captures: that of its folder, and of its file where the
    folder has several."""
    several = len(list(file.parent.glob(CAPTURES))) > 1
    parts = [*folder.parts, *([_stem(file)] if several or file.parent == top else [])]
    return "-".join(parts)


def _stem(file: Path) -> str:
    return file.name.removesuffix(".capture.toml").removesuffix(".toml")


def _unique(items: list[Item], path: Path) -> tuple[Item, ...]:
    """The objects, with names that are names of folders. Raises InputError where two are equal."""
    taken: dict[str, Item] = {}
    for item in items:
        name = re.sub(r"[^\w.\- ]", "_", item.name).strip(". ")[:MAX_NAME] or "object"
        folded = as_file_name(name)
        if folded in taken:
            raise InputError(
                f"has two objects with the name {name!r}: {taken[folded].capture} and "
                f"{item.capture}; give each a name of its own in a table",
                file=path,
            )
        taken[folded] = Item(name, item.capture, item.session)
    return tuple(sorted(taken.values(), key=lambda item: item.name))
