"""A new capture before it is written: what was recognised, what is missing, and the text."""

from __future__ import annotations

import os
from dataclasses import dataclass
from enum import Enum
from pathlib import Path

import numpy as np

from ..capture.new_capture import LampText, PhotoText, write_capture
from ..counted import listed
from ..errors import InputError


class LampKind(Enum):
    """How the light of a draft's lamp is known."""

    UNKNOWN = "unknown"  # distant; found from the photos later
    FLASH = "flash"  # on the camera; its offset is found from the photos unless it is stated
    DISTANT = "distant"  # in a stated direction
    SUN = "sun"  # from time and place of the photos
    NEAR = "near"  # at a position that is found from the photos unless it is stated


NEAR_KINDS = {LampKind.FLASH, LampKind.NEAR}  # their strength falls off with distance


@dataclass(frozen=True)
class DraftPhoto:
    """file: of a lit photo. camera: label, None without one. how: the camera was found, in words.
    lamp: index. used: part of the capture."""

    file: Path
    camera: str | None = None
    how: str = ""
    lamp: int = 0
    used: bool = True


@dataclass(frozen=True)
class DraftLamp:
    """values: direction (unit), position or offset by kind. stated: the user gave the values; else
    they are a guess."""

    name: str
    kind: LampKind = LampKind.UNKNOWN
    values: tuple[float, float, float] = (0.0, 0.0, 1.0)
    stated: bool = False


@dataclass(frozen=True)
class Draft:
    """cameras, mesh: files, None while unknown. images: folder of the scan's own photos. extra:
    file of cameras that were localised. found: sentences on what was recognised. problems:
    sentences on what is wrong. camera_labels: of the scan."""

    cameras: Path | None = None
    mesh: Path | None = None
    images: Path | None = None
    photos: tuple[DraftPhoto, ...] = ()
    lamps: tuple[DraftLamp, ...] = ()
    found: tuple[str, ...] = ()
    problems: tuple[str, ...] = ()
    camera_labels: tuple[str, ...] = ()
    extra: Path | None = None

    @property
    def folder(self) -> Path | None:
        """The folder that holds all of its files, None without files."""
        files = [*filter(None, (self.cameras, self.mesh)), *(p.file for p in self.photos)]
        try:
            return Path(os.path.commonpath([file.parent for file in files])) if files else None
        except ValueError:  # on several drives
            return files[0].parent

    @property
    def without_camera(self) -> tuple[Path, ...]:
        """The used photos without a camera."""
        return tuple(p.file for p in self.photos if p.used and p.camera is None)

    @property
    def missing(self) -> str | None:
        """What is needed next, None if the capture can be written."""
        if self.cameras is None:
            return "Add the cameras of the scan, or solve them from its photos"
        if self.mesh is None:
            return "Add the mesh of the scan, in the coordinates of its cameras"
        used = [photo for photo in self.photos if photo.used]
        if not used:
            return "Add the lit photos"
        lost = [file.name for file in self.without_camera]
        if lost:
            have = "photo has" if len(lost) == 1 else "photos have"
            localise = "Localise them, choose cameras" if self.images is not None else "Choose one"
            return f"{len(lost)} {have} no camera: {listed(lost)}. {localise} or switch them off"
        kinds = {self.lamps[photo.lamp].kind for photo in used if photo.lamp < len(self.lamps)}
        if kinds & NEAR_KINDS and kinds - NEAR_KINDS:
            return (
                "A lamp near the object or on the camera and one far away have no common scale. "
                "Make two captures, or set all lamps to one of the two"
            )
        return None

    def write(self, out: Path) -> None:
        """Write the capture file. It appears only after it was read back. Raises InputError."""
        if self.missing is not None:
            raise InputError(f"the capture is not complete: {self.missing}", file=out)
        assert self.cameras is not None and self.mesh is not None  # missing is None
        used = [photo for photo in self.photos if photo.used]
        lamps = sorted({photo.lamp for photo in used})
        write_capture(
            out, self.cameras, self.mesh,
            [PhotoText(p.file, p.camera or "", self.lamps[p.lamp].name) for p in used],
            [(self.lamps[index].name, lamp_text(self.lamps[index])) for index in lamps],
            self.images, extra=self.extra,
        )  # fmt: skip


def lamp_text(lamp: DraftLamp) -> LampText:
    """The lamp's line in a capture file; what was not stated is marked as a guess."""
    if lamp.kind is LampKind.SUN:
        return LampText.sun()
    make = {
        LampKind.FLASH: LampText.flash,
        LampKind.NEAR: LampText.near,
        LampKind.UNKNOWN: LampText.distant,
        LampKind.DISTANT: LampText.distant,
    }[lamp.kind]
    values = np.array(lamp.values)
    if make is LampText.distant and not np.linalg.norm(values) > 0:
        values = np.array([0.0, 0.0, 1.0])
    return make(values.tolist(), guess=not lamp.stated)
