"""The content of a capture file, checked and with absolute paths."""

from __future__ import annotations

import os
from dataclasses import dataclass, field
from pathlib import Path

from ..errors import InputError
from .entries import FitOptions, LightEntry, MaterialEntry, PhotoEntry, ToneEntry

SHADOW_MASK, HIGHLIGHT_MASK, IGNORE_MASK = "shadow", "highlight", "ignore"
EXCLUDED_MASKS = (SHADOW_MASK, HIGHLIGHT_MASK, IGNORE_MASK)
"""Masks of pixels that are not measured: "shadow", where the light does not come from the lamp
alone; "highlight", highlights that are not the material's (glare, a bulb's reflection in a
window); "ignore", anything else that is not the object."""


@dataclass(frozen=True)
class ScanEntry:
    """[scan]. chunk: name of the chunk in a project with several; frame: coordinate frame of the
    mesh, where the scan has several; extra: cameras of additional photos (written by ``localise``);
    texture: replaces the mesh's own."""

    cameras: Path
    mesh: Path
    images: Path | None = None
    chunk: str | None = None
    frame: str | None = None
    extra: Path | None = None
    texture: Path | None = None


@dataclass(frozen=True)
class Capture:
    """A whole capture. lines: {key path: line in the file}, for error messages."""

    file: Path
    scan: ScanEntry
    tone: ToneEntry
    lights: tuple[LightEntry, ...]
    photos: tuple[PhotoEntry, ...]
    materials: tuple[MaterialEntry, ...]
    fit: FitOptions
    lines: dict[tuple[str | int, ...], int] = field(default_factory=dict)

    def photo_name(self, place: int) -> str:
        """A photo's path relative to the capture file, because file names alone may not be unique.

        place: index of the photo, from 0.
        """
        return Path(os.path.relpath(self.photos[place].file, self.file.parent)).as_posix()

    def named_by_masks(self, material: str) -> bool:
        """True where some photo has a mask for this material."""
        return any(material in photo.masks for photo in self.photos)

    def error(self, message: str, *path: str | int) -> InputError:
        """An InputError that names this file, the key at ``path`` and its line."""
        return key_error(self.file, self.lines, message, *path)


def key_error(
    file: Path, lines: dict[tuple[str | int, ...], int], message: str, *path: str | int
) -> InputError:
    """An InputError about the key at ``path``; indices are shown counted from 1."""
    words: list[str] = []
    for part in path:
        if isinstance(part, int):
            words[-1] += f" {part + 1}"
        else:
            words.append(part)
    line = next((lines[path[:n]] for n in range(len(path), 0, -1) if path[:n] in lines), None)
    return InputError(message, file=file, key=".".join(words), line=line)
