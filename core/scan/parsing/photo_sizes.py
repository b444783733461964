"""How large the photos are, for formats that do not say."""

from __future__ import annotations

import os
from collections import defaultdict
from collections.abc import Iterator
from pathlib import Path, PurePosixPath

from ...errors import InputError
from .photo_labels import base_name

MOST_FILES = 100_000  # of a photo folder that are looked at
DEEPEST = 4  # folders within it
PHOTO_SUFFIXES = {
    ".jpg", ".jpeg", ".png", ".tif", ".tiff", ".exr", ".hdr", ".bmp", ".webp", ".jp2", ".heic",
    ".dng", ".cr2", ".cr3", ".nef", ".arw", ".raf", ".orf", ".rw2", ".pef",
}  # fmt: skip


class PhotoSizes:
    """Sizes of photos by the names a tool gave them.

    images: the folder the user names; photos are found in it by their file's name. Without it they
    are looked for where the tool's file says, but never outside that file's own folder.
    """

    def __init__(self, images: Path | None, beside: Path) -> None:
        if images is not None and not images.is_dir():
            raise InputError("no such folder of photos", file=images)
        self.images = images
        self.beside = beside
        self._known: dict[Path, tuple[int, int] | None] = {}
        self._index: dict[str, list[Path]] | None = None

    def size(self, name: str) -> tuple[int, int] | None:
        """(width, height) of the photo, or None where it is not found or cannot be read."""
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
        """The photo's file, where there is just one."""
        if self.images is not None:
            return self._by_name(name)
        tidy = PurePosixPath(name.replace("\\", "/"))
        if tidy.is_absolute() or ".." in tidy.parts or ":" in tidy.as_posix():
            tidy = PurePosixPath(base_name(name))
        for candidate in (tidy, PurePosixPath(tidy.name)):
            found = self._within(candidate)
            if found is not None:
                return found
        return None

    def _within(self, relative: PurePosixPath) -> Path | None:
        """A photo in the tool's folder; its extension may be missing."""
        path = self.beside / relative
        candidates = [path]
        if path.suffix.lower() not in PHOTO_SUFFIXES:
            for suffix in (".png", ".jpg", ".jpeg", ".exr", ".tif", ".JPG", ".PNG"):
                candidates.append(path.with_name(path.name + suffix))
        for candidate in candidates:
            try:
                inside = candidate.resolve().is_relative_to(self.beside.resolve())
                if inside and candidate.is_file():
                    return candidate
            except (OSError, ValueError, RuntimeError):  # a name no file can have; a loop of links
                continue
        return None

    def _by_name(self, name: str) -> Path | None:
        """A photo in the user's folder: of that name, or the only one of that name without its
        extension. Of several in different folders the one with the same path's end."""
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
    """Photos in a folder and those within it, bounded."""
    count = 0
    depth = len(folder.parts)
    for here, folders, names in os.walk(folder):
        if len(Path(here).parts) - depth >= DEEPEST:
            folders.clear()
        for name in sorted(names):
            count += 1
            if count > MOST_FILES:
                return
            if Path(name).suffix.lower() in PHOTO_SUFFIXES:
                yield Path(here) / name
