"""Names for cameras: what a tool wrote is a path on somebody's disk."""

from __future__ import annotations

from collections import Counter
from collections.abc import Sequence

from ...errors import InputError

LONGEST = 4096  # characters of a path


def base_name(path: str) -> str:
    """The last part of a path of any system."""
    return path.replace("\\", "/").rstrip("/").rpartition("/")[2]


def labels_of(paths: Sequence[str], file: object) -> list[str]:
    """A label for each photo: its file's name; with folders, from where they begin to differ,
    where two of one name lie in different ones. Raises InputError for a path without a name."""
    tidy = [path.replace("\\", "/").rstrip("/") for path in paths]
    for path in tidy:
        if not base_name(path) or len(path) > LONGEST or "\0" in path:
            raise InputError(f"{path[:60]!r} is not the name of a photo", file=str(file))
    names = Counter(base_name(path) for path in tidy)
    twice = [path for path in tidy if names[base_name(path)] > 1]
    common = _common_folder(twice)
    return [path[common:] if names[base_name(path)] > 1 else base_name(path) for path in tidy]


def _common_folder(paths: list[str]) -> int:
    """How many characters of all paths are one folder."""
    if not paths:
        return 0
    first, last = min(paths), max(paths)
    same = 0
    while same < min(len(first), len(last)) and first[same] == last[same]:
        same += 1
    return first.rfind("/", 0, same) + 1
