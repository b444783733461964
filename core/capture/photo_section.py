"""Read the tables [tone] and [[photo]]: the photos and the meaning of their pixel values."""

from __future__ import annotations

from pathlib import Path

from ..errors import InputError
from ..photo.transfer import Transfer
from .entries import ChartEntry, PhotoEntry, ToneEntry
from .model import EXCLUDED_MASKS
from .section import Section

MAX_BRACKET_FILES = 32


def read_tone(section: Section) -> ToneEntry:
    """The [tone] table. Raises InputError naming the key and the line."""
    transfer = _transfer(section)
    chart = _chart(section.table("chart")) if "chart" in section else None
    if chart is not None and transfer not in (None, "auto"):
        raise section.error(
            "the curve is given and also measured by a chart; expected only one: remove transfer "
            "or chart",
            "transfer",
        )
    section.get("chart")
    section.close()
    return ToneEntry(transfer or "auto", chart)


def _transfer(section: Section) -> str | None:
    name = section.optional_text("transfer")
    if name is not None:
        try:
            Transfer.named(name)
        except InputError as error:
            raise section.error(str(error), "transfer") from error
    return name


def _chart(section: Section) -> ChartEntry:
    photo = section.file_path("photo")
    greys = section.number_list("reflectance", 2, 100)
    corners = section.points("corners", 2 if greys is not None else 4)
    if greys is not None and not all(0.001 < grey <= 1.0 for grey in greys):
        raise section.error(
            "found a reflectance out of range; expected 0.001 to 1 for each patch", "reflectance"
        )
    light, normal = section.optional_text("light"), section.vector("normal")
    section.close()
    return ChartEntry(photo, corners, greys, light, normal)


def read_photo_entry(section: Section, lights: set[str], materials: set[str]) -> PhotoEntry:
    """One [[photo]] table. Raises InputError naming the key and the line."""
    files = _files(section)
    camera, light = section.text("camera"), section.text("light")
    exposures = _exposures(section, len(files))
    transfer = _transfer(section)
    saturation = section.number("saturation", 1.0, 1e-9, 1e12) if "saturation" in section else None
    entries = section.table("masks")
    masks = {}
    for name in entries.data:
        if name not in EXCLUDED_MASKS and name not in materials:
            raise entries.error(
                f"no [[material]] is named {name!r}; expected the name of a material, or shadow, "
                "highlight or ignore",
                name,
            )
        masks[name] = entries.file_path(name)
    section.close()
    if light not in lights:
        known = ", ".join(sorted(lights)) or "none"
        raise section.error(f"no [[light]] is named {light!r}; expected one of: {known}", "light")
    return PhotoEntry(files, camera, light, exposures, transfer, saturation, masks)


def _files(section: Section) -> tuple[Path, ...]:
    value = section.get("file", required=True)
    if not isinstance(value, list):
        return (section.file_path("file"),)
    if not 1 <= len(value) <= MAX_BRACKET_FILES:
        raise section.error(f"expected 1 to {MAX_BRACKET_FILES} files of one viewpoint", "file")
    return tuple(section.path_of(one, "file") for one in value)


def _exposures(section: Section, count: int) -> tuple[float, ...] | None:
    value = section.get("exposure")
    if value is None:
        return None
    if not isinstance(value, list):
        if count > 1:
            raise section.error(f"expected {count} exposures, one per file", "exposure")
        return (section.number("exposure", 1.0, low=1e-12, high=1e12),)
    exposures = section.number_list("exposure", count, count)
    assert exposures is not None
    if not all(1e-12 <= exposure <= 1e12 for exposure in exposures):
        raise section.error(
            "found a number that is not positive; expected 1e-12 to 1e12", "exposure"
        )
    return exposures
