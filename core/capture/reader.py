"""Read a capture file (TOML) and check everything that can be checked without opening images."""

from __future__ import annotations

import os
import tomllib
from dataclasses import replace
from pathlib import Path

from ..errors import InputError
from ..files import as_file_name, regular_size
from ..fit import PaperSettings
from ..samples import Margins
from .entries import FitOptions, LightEntry, MaterialEntry, PhotoEntry, ToneEntry
from .light_section import read_light
from .lines import key_lines
from .model import EXCLUDED_MASKS, Capture, ScanEntry
from .photo_section import read_photo_entry, read_tone
from .section import Section, shown

WINDOWS_DEVICES = {
    "CON",
    "PRN",
    "AUX",
    "NUL",
    *(f"{n}{i}" for n in ("COM", "LPT") for i in range(10)),
}
METHODS = ("measured", "paper")  # the first is the default
PAPER_KEYS = (
    "samples", "trials", "subset", "curvature", "monotonicity", "highest_intensity", "eta", "seed",
)  # fmt: skip
MAX_FILE_BYTES = 1_000_000  # a capture of a thousand photos has a tenth of it
MAX_LINE_LENGTH = 10_000  # characters


def read_capture(path: Path, margins: Margins | None = None) -> Capture:
    """Read the capture in a file.

    margins: used where the file gives none (default: the documented ones). Raises InputError
    naming the key and the line.
    """
    top = open_capture(path)
    lines = top.lines

    scan = _scan(top.table("scan"))
    tone = read_tone(top.table("tone"))
    lights = tuple(read_light(section) for section in top.tables("light"))
    materials = tuple(_material(section) for section in top.tables("material"))
    _check_unique(top, "light", [light.name for light in lights])
    _check_unique(top, "material", [material.name for material in materials])
    lights = _mark_charted(top, tone, lights)
    known = [light.strength_given for light in lights]
    if any(known) and not all(known):
        place = known.index(False)
        raise top.error(
            "the irradiance (or intensity) is missing for this light but given for others; "
            "expected it for all lights or for none",
            "light",
            place,
            "irradiance" if lights[place].distant else "intensity",
        )
    if lights and not any(known) and len({light.distant for light in lights}) > 1:
        place = next(i for i, light in enumerate(lights) if not light.distant)
        raise top.error(
            "near and distant lights of unknown strength have no common scale; expected irradiance "
            "and intensity: give both",
            "light", place, "intensity",
        )  # fmt: skip
    photos = tuple(
        read_photo_entry(section, {light.name for light in lights}, {m.name for m in materials})
        for section in top.tables("photo")
    )
    _check_distinct_files(top, photos, {m.name for m in materials if m.by_mesh})
    _check_located(top, materials, {name for photo in photos for name in photo.masks})
    fit = _fit(top.table("fit"), margins or Margins())
    top.table("diagnose").close()
    top.close()
    if not photos:
        raise top.error("has no [[photo]]; expected at least one lit photo", "photo")
    return Capture(
        file=path.resolve(),
        scan=scan,
        tone=tone,
        lights=lights,
        photos=photos,
        materials=materials or (MaterialEntry("surface"),),
        fit=fit,
        lines=lines,
    )


def open_capture(path: Path) -> Section:
    """The whole file as a Section that is read key by key. Raises InputError."""
    text = _text(path)
    try:
        data = tomllib.loads(text)
    except tomllib.TOMLDecodeError as error:
        raise InputError(f"is not valid TOML ({error})", file=path) from error
    except (ValueError, RecursionError) as error:  # a number too large, or nesting too deep
        raise InputError(f"is not a capture file ({error})", file=path) from error
    return Section(data, path.resolve(), key_lines(text))


def read_scan_entry(path: Path) -> ScanEntry:
    """Read only [scan], from a file that may have no lights or photos yet. Raises InputError."""
    return _scan(open_capture(path).table("scan"))


def _mark_charted(
    top: Section, tone: ToneEntry, lights: tuple[LightEntry, ...]
) -> tuple[LightEntry, ...]:
    """The lights, with ``charted`` set for the light of the chart."""
    chart = tone.chart
    if chart is None or chart.light is None:
        return lights
    names = [light.name for light in lights]
    if chart.light not in names:
        known = ", ".join(names) or "none"
        raise top.error(
            f"no [[light]] is named {chart.light!r}; expected one of: {known}",
            "tone",
            "chart",
            "light",
        )
    place = names.index(chart.light)
    if not lights[place].distant:
        raise top.error(
            f"{chart.light!r} is a near light; expected a distant light, because a chart gives "
            "only the irradiance of a distant light",
            "tone",
            "chart",
            "light",
        )
    if lights[place].strength_given:
        raise top.error(
            f"the irradiance of {chart.light!r} is also given elsewhere; expected it only once: "
            "remove it there or remove this key",
            "tone", "chart", "light",
        )  # fmt: skip
    return (*lights[:place], replace(lights[place], charted=True), *lights[place + 1 :])


def _scan(section: Section) -> ScanEntry:
    entry = ScanEntry(
        cameras=section.file_path("cameras"),
        mesh=section.file_path("mesh"),
        images=section.optional_file_path("images"),
        chunk=section.optional_text("chunk"),
        frame=section.optional_text("frame"),
        extra=section.optional_file_path("extra"),
        texture=section.optional_file_path("texture"),
    )
    if entry.images is not None and not entry.images.is_dir():
        raise section.error(f"found a file ({entry.images}); expected a folder", "images")
    section.close()
    return entry


def _text(path: Path) -> str:
    try:
        if regular_size(path) > MAX_FILE_BYTES:
            raise InputError("is too large for a capture file; expected at most 1 MB", file=path)
        text = path.read_text("utf-8-sig")
    except (OSError, ValueError) as error:
        if isinstance(error, UnicodeDecodeError):
            raise InputError("is not UTF-8 text; save it as UTF-8", file=path) from error
        reason = getattr(error, "strerror", None) or error
        raise InputError(f"cannot be read ({reason})", file=path) from error
    if max(map(len, text.splitlines()), default=0) > MAX_LINE_LENGTH:
        raise InputError(
            "has a line that is too long for a capture file; expected at most 10,000 characters",
            file=path,
        )
    return text


def _check_unique(top: Section, kind: str, names: list[str]) -> None:
    """Raise InputError where two tables have the same name."""
    for place, name in enumerate(names):
        if as_file_name(name) in [as_file_name(other) for other in names[:place]]:
            raise top.error(
                f"the name {name!r} is used twice; expected unique names", kind, place, "name"
            )


def _check_distinct_files(top: Section, photos: tuple[PhotoEntry, ...], by_mesh: set[str]) -> None:
    """Raise InputError where a photo is listed twice, which would count its pixels twice, and where
    two materials that only masks locate have one mask in a photo. by_mesh: other materials."""
    seen: dict[str, int] = {}
    for place, photo in enumerate(photos):
        for file in photo.files:
            first = seen.setdefault(os.path.realpath(file), place)
            if first != place or photo.files.count(file) > 1:
                raise top.error(
                    f"{file.name!r} is listed more than once (photo {first + 1}); expected each "
                    "file once: remove one of the entries",
                    "photo", place, "file",
                )  # fmt: skip
        masks: dict[str, str] = {}
        for name, mask in photo.masks.items():
            if name in by_mesh or name in EXCLUDED_MASKS:
                continue
            other = masks.setdefault(os.path.realpath(mask), name)
            if other != name:
                raise top.error(
                    f"{name!r} and {other!r} have the same mask {mask.name!r}; expected a mask for "
                    "each material",
                    "photo", place, "masks", name,
                )  # fmt: skip


def _material(section: Section) -> MaterialEntry:
    name = section.text("name")
    faces = section.optional_text("faces")
    vertex, texture = _colour(section, "vertex_colour"), _colour(section, "texture_colour")
    section.close()
    if sum(way is not None for way in (faces, vertex, texture)) > 1:
        raise section.error(
            "found more than one of faces, vertex_colour and texture_colour; expected at most one",
            "faces",
        )
    if name in EXCLUDED_MASKS:
        raise section.error(
            f"{name!r} is reserved for masks of excluded pixels; choose another name", "name"
        )
    if not _is_file_name(name):
        raise section.error(
            f"{name[:60]!r} cannot be part of a file name on every system; choose another name",
            "name",
        )
    return MaterialEntry(name, faces, vertex, texture)


def _colour(section: Section, key: str) -> tuple[int, int, int] | None:
    value = section.numbers(key, 3)
    if value is None:
        return None
    if ((value < 0) | (value > 255) | (value % 1 != 0)).any():
        raise section.error(
            "found a value out of range; expected three whole numbers from 0 to 255 (sRGB)", key
        )
    red, green, blue = (int(x) for x in value)
    return red, green, blue


def _is_file_name(name: str) -> bool:
    """True for a name that Linux, macOS and Windows all accept as the start of a file name."""
    return (
        name.isprintable()
        and len(name.encode()) <= 100
        and not any(c in name for c in '/\\:*?"<>|')
        and name.strip(". ") == name
        and name.split(".")[0].upper() not in WINDOWS_DEVICES
    )


def _check_located(top: Section, materials: tuple[MaterialEntry, ...], masked: set[str]) -> None:
    """Raise InputError where two materials both cover the whole object (masks were forgotten)."""
    whole = [i for i, m in enumerate(materials) if not m.by_mesh and m.name not in masked]
    if len(whole) > 1:
        raise top.error(
            f"{materials[whole[0]].name!r} and {materials[whole[1]].name!r} would both cover the "
            "whole object; expected at most one such material: give the others masks or faces",
            "material",
            whole[1],
            "name",
        )


def _fit(section: Section, margins: Margins) -> FitOptions:
    paper = PaperSettings()
    method = section.optional_text("method") or METHODS[0]
    if method not in METHODS:
        known = " or ".join(f"{m!r}" for m in METHODS)
        raise section.error(f"found {shown(method)}; expected {known}", "method")
    curvature = section.number("curvature", paper.curvature or 0.0, low=0.0)
    samples = section.integer("samples", paper.samples, 1, 40)
    subset = section.integer("subset", paper.subset, 10, 1_000_000)
    if subset < 2 * samples:
        raise section.error(
            f"found {subset}; expected at least twice the number of samples", "subset"
        )
    options = FitOptions(
        method=method,
        absolute=section.flag("absolute", True),
        margins=Margins(
            silhouette=section.integer("silhouette_margin", margins.silhouette, 0, 100),
            shadow=section.integer("shadow_margin", margins.shadow, 0, 100),
            mask=section.integer("mask_margin", margins.mask, 0, 100),
            cosine=section.number("smallest_cosine", margins.cosine, 0.001, 0.99),
        ),
        paper=PaperSettings(
            samples=samples,
            trials=section.integer("trials", paper.trials, 1, 10_000),
            subset=subset,
            curvature=curvature if curvature > 0 else None,  # 0 switches the test off
            monotonicity=section.flag("monotonicity", paper.monotonicity),
            highest_intensity=section.flag("highest_intensity", paper.highest_intensity),
            eta=section.number("eta", paper.eta, 0.0, 1e9),
            seed=section.integer("seed", paper.seed, 0),
        ),
        held_out=section.flag("held_out", True),
        unused=() if method == "paper" else tuple(k for k in PAPER_KEYS if k in section),
    )
    section.close()
    return options
