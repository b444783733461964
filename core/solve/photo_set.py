"""A folder of photos: which files are photos, and which photos share a lens."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

from ..errors import InputError
from ..photo import Exif

PICTURES = {".jpg", ".jpeg", ".png", ".tif", ".tiff", ".exr", ".hdr"}
RAW = {".cr2", ".cr3", ".nef", ".arw", ".dng", ".raf", ".orf", ".rw2", ".pef"}
MAX_PHOTOS = 20_000
UNKNOWN_FOCAL = 1.2  # × the longer side: what COLMAP assumes, about 45 mm on 35 mm film
FILM_WIDTH = 36.0  # mm


@dataclass(frozen=True)
class PhotoFile:
    """name: path inside the folder, with / as separator on every system: the photo's label."""

    name: str
    path: Path


def find_photos(folder: Path) -> list[PhotoFile]:
    """All photos of a folder and its subfolders, by name. Raises InputError.

    A RAW file is left out where a picture with the same name is in the same folder. Hidden files
    and folders are left out.
    """
    if not folder.is_dir():
        found = "is a file" if folder.exists() else "no such folder"
        raise InputError(f"{found}; expected a folder of photos", file=folder)
    try:
        files = sorted(p for p in folder.rglob("*") if _visible(p, folder) and p.is_file())
    except OSError as error:
        raise InputError(f"cannot be read ({error.strerror})", file=folder) from error
    pictures = [p for p in files if p.suffix.lower() in PICTURES]
    stems = {p.with_suffix("") for p in pictures}
    raws = [p for p in files if p.suffix.lower() in RAW and p.with_suffix("") not in stems]
    photos = [PhotoFile(p.relative_to(folder).as_posix(), p) for p in sorted(pictures + raws)]
    if len(photos) > MAX_PHOTOS:
        raise InputError(f"holds {len(photos)} photos; expected at most {MAX_PHOTOS}", file=folder)
    return photos


def _visible(path: Path, folder: Path) -> bool:
    return not any(part.startswith(".") for part in path.relative_to(folder).parts)


@dataclass(frozen=True)
class LensKey:
    """Photos with equal keys are assumed to share a lens at one setting."""

    width: int
    height: int
    make: str | None
    model: str | None
    lens: str | None
    focal_length: float | None  # mm

    @classmethod
    def of(cls, size: tuple[int, int], exif: Exif) -> LensKey:
        """From a photo's (width, height) and its Exif."""
        return cls(*size, exif.make, exif.model, exif.lens, exif.focal_length)


def first_focal(size: tuple[int, int], exif: Exif) -> tuple[float, bool]:
    """(initial focal length, pixels; whether it comes from Exif)."""
    longer = max(size)
    if exif.focal_length_35mm:
        return longer * exif.focal_length_35mm / FILM_WIDTH, True
    return UNKNOWN_FOCAL * longer, False
