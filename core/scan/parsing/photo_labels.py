"""Labels of cameras from the photo paths that a tool wrote on another computer."""

from __future__ import annotations

from collections import Counter
from collections.abc import Sequence

from ...errors import InputError

MAX_PATH_LENGTH = 4096  # characters


def base_name(path: str) -> str:
    """Last component of a path, with the separators of any system."""
    return path.replace("\\", "/").rstrip("/").rpartition("/")[2]


def labels_of(paths: Sequence[str], file: object) -> list[str]:
    """A unique label for each photo: its file name. Where several photos have the same file name,
    their paths from the first differing folder. Raises InputError for a path without a name."""
    normalised = [path.replace("\\", "/").rstrip("/") for path in paths]
    for path in normalised:
        if not base_name(path) or len(path) > MAX_PATH_LENGTH or "\0" in path:
            raise InputError(f"{path[:60]!r} is not a valid name of a photo", file=str(file))
    names = Counter(base_name(path) for path in normalised)
    duplicates = [path for path in normalised if names[base_name(path)] > 1]
    common = _common_folder(duplicates)
    return [path[common:] if names[base_name(path)] > 1 else base_name(path) for path in normalised]


def _common_folder(paths: list[str]) -> int:
    """Length in characters of the folder that all paths share."""
    if not paths:
        return 0
    first, last = min(paths), max(paths)
    common_length = 0
    while (
        common_length < min(len(first), len(last)) and first[common_length] == last[common_length]
    ):
        common_length += 1
    return first.rfind("/", 0, common_length) + 1
