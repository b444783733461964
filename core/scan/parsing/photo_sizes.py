"""Find the sizes of photos, for formats that do not hold them."""

from __future__ import annotations

import os
from collections import defaultdict
from collections.abc import Iterator
from pathlib import Path, PurePosixPath

from ...errors import InputError
from .photo_labels import base_name

MAX_FILES = 100_000  # examined in a photo folder
MAX_DEPTH = 4  # levels of folders below it
PHOTO_SUFFIXES = {
    ".jpg", ".jpeg", ".png", ".tif", ".tiff", ".exr", ".hdr", ".bmp", ".webp", ".jp2", ".heic",
    ".dng", ".cr2", ".cr3", ".nef", ".arw", ".raf", ".orf", ".rw2", ".pef",
}  # fmt: skip


class PhotoSizes:
    """Sizes of photos by the names a tool gave them.

    images: the folder that the user names; photos are found in it by file name. Without it, photos
    are searched at the paths in the tool's file, but only inside the folder of that file
    (``search_folder``).
    """

    def __init__(self, images: Path | None, search_folder: Path) -> None:
        if images is not None and not images.is_dir():
            raise InputError("no such folder; expected a folder of photos", file=images)
        self.images = images
        self.search_folder = search_folder
        self._known: dict[Path, tuple[int, int] | None] = {}
        self._index: dict[str, list[Path]] | None = None

    def size(self, name: str) -> tuple[int, int] | None:
        """(width, height) of the photo; None where it is not found or cannot be read."""
        path = self.find(name)
        if path is None:
            return None
        if path not in self._known:
            from ...photo.image import image_size  # photo imports scan

            try:
                self._known[path] = image_size(path)
            except InputError:
                self._known[path] = None
        return self._known[path]

    def find(self, name: str) -> Path | None:
        """Path of the photo; None where no or several files match."""
        if self.images is not None:
            return self._by_name(name)
        normalised = PurePosixPath(name.replace("\\", "/"))
        if normalised.is_absolute() or ".." in normalised.parts or ":" in normalised.as_posix():
            normalised = PurePosixPath(base_name(name))
        for candidate in (normalised, PurePosixPath(normalised.name)):
            found = self._within(candidate)
            if found is not None:
                return found
        return None

    def _within(self, relative: PurePosixPath) -> Path | None:
        """A photo in the tool's folder; its extension may be missing in ``relative``."""
        path = self.search_folder / relative
        candidates = [path]
        if path.suffix.lower() not in PHOTO_SUFFIXES:
            for suffix in (".png", ".jpg", ".jpeg", ".exr", ".tif", ".JPG", ".PNG"):
                candidates.append(path.with_name(path.name + suffix))
        for candidate in candidates:
            try:
                inside = candidate.resolve().is_relative_to(self.search_folder.resolve())
                if inside and candidate.is_file():
                    return candidate
            except (OSError, ValueError, RuntimeError):  # an impossible file name; a loop of links
                continue
        return None

    def _by_name(self, name: str) -> Path | None:
        """A photo in the user's folder with that name, or the only one with that name apart from
        its extension. Of several in different folders, the one whose path ends in the given path.
        """
        if self._index is None:
            self._index = defaultdict(list)
            assert self.images is not None
            for path in _files(self.images):
                self._index[path.name.lower()].append(path)
                self._index[path.stem.lower()].append(path)
        base = base_name(name).lower()
        found = self._index.get(base) or self._index.get(PurePosixPath(base).stem) or []
        if len(found) > 1:
            ends = name.replace("\\", "/").lower().lstrip("./")
            found = [path for path in found if path.as_posix().lower().endswith("/" + ends)]
        return found[0] if len(found) == 1 else None


def _files(folder: Path) -> Iterator[Path]:
    """Photos in a folder and its subfolders, at most MAX_FILES files and MAX_DEPTH levels."""
    count = 0
    depth = len(folder.parts)
    for here, folders, names in os.walk(folder):
        if len(Path(here).parts) - depth >= MAX_DEPTH:
            folders.clear()
        for name in sorted(names):
            count += 1
            if count > MAX_FILES:
                return
            if Path(name).suffix.lower() in PHOTO_SUFFIXES:
                yield Path(here) / name
