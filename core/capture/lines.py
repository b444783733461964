"""Find the line of each key in a TOML text; the standard parser does not report lines."""

from __future__ import annotations

import re

HEADER = re.compile(r"^\s*(\[\[?)\s*([\w\-. \"']+?)\s*\]\]?\s*(#.*)?$")
KEY = re.compile(r"^\s*([\w\-\"']+)\s*=")


def key_lines(text: str) -> dict[tuple[str | int, ...], int]:
    """{key path: line}, lines counted from 1; members of arrays of tables by index from 0, as in
    ("photo", 2, "file")."""
    lines: dict[tuple[str | int, ...], int] = {}
    counts: dict[str, int] = {}
    here: tuple[str | int, ...] = ()
    for number, line in enumerate(text.splitlines(), start=1):
        if header := HEADER.match(line):
            name = header.group(2).strip("\"' ")
            if header.group(1) == "[[":
                place = counts.get(name, -1) + 1
                counts[name] = place
                here = (name, place)
            else:
                here = (name,)
            lines.setdefault(here, number)
        elif key := KEY.match(line):
            lines.setdefault((*here, key.group(1).strip("\"'")), number)
    return lines
