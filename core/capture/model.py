"""What a capture file says, checked and with absolute paths."""

from __future__ import annotations

import os
from dataclasses import dataclass, field
from pathlib import Path

from ..errors import InputError
from ..fit import PaperSettings
from ..light import DistantLight
from ..samples import Margins

SHADOW_MASK = "shadow"


@dataclass(frozen=True)
class PhotoEntry:
    """One lit photo. camera: label of the scan camera that shares its viewpoint; light: name of a
    light; exposure: divides the pixels; masks: material (or "shadow") → mask file, white = in."""

    file: Path
    camera: str
    light: str
    exposure: float = 1.0
    masks: dict[str, Path] = field(default_factory=dict)


@dataclass(frozen=True)
class MaterialEntry:
    """One material to fit. faces: name of the mesh's integer face attribute that says which faces
    are of it (their value is the material's place in the list, from 0); None: masks, or all."""

    name: str
    faces: str | None = None


@dataclass(frozen=True)
class FitOptions:
    """[fit]: what is too close to trust, and the estimator's settings."""

    margins: Margins = field(default_factory=Margins)
    paper: PaperSettings = field(default_factory=PaperSettings)
    held_out: bool = True


@dataclass(frozen=True)
class Capture:
    """A whole capture. lines: key path → line in the file, for messages."""

    file: Path
    cameras: Path
    mesh: Path
    images: Path | None
    lights: tuple[DistantLight, ...]
    photos: tuple[PhotoEntry, ...]
    materials: tuple[MaterialEntry, ...]
    fit: FitOptions
    lines: dict[tuple[str | int, ...], int] = field(default_factory=dict)

    def light(self, name: str) -> DistantLight:
        """The light of that name (the reader has checked that it is there)."""
        return next(light for light in self.lights if light.name == name)

    def photo_name(self, place: int) -> str:
        """A photo's file relative to the capture file: two folders may hold the same name."""
        return Path(os.path.relpath(self.photos[place].file, self.file.parent)).as_posix()

    def named_by_masks(self, material: str) -> bool:
        """True where some photo's mask says where this material is."""
        return any(material in photo.masks for photo in self.photos)

    def error(self, message: str, *path: str | int) -> InputError:
        """An InputError that names this file, the key at ``path`` and its line."""
        return key_error(self.file, self.lines, message, *path)


def key_error(
    file: Path, lines: dict[tuple[str | int, ...], int], message: str, *path: str | int
) -> InputError:
    """An InputError about the key at ``path``; array places are shown counted from 1."""
    words: list[str] = []
    for part in path:
        if isinstance(part, int):
            words[-1] += f" {part + 1}"
        else:
            words.append(part)
    line = next((lines[path[:n]] for n in range(len(path), 0, -1) if path[:n] in lines), None)
    return InputError(message, file=file, key=".".join(words), line=line)
