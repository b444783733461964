"""Read a capture file (TOML). Everything that can be refused without opening images is refused."""

from __future__ import annotations

import tomllib
from pathlib import Path

import numpy as np

from ..errors import InputError
from ..fit import PaperSettings
from ..light import DistantLight
from ..samples import Margins
from .lines import key_lines
from .model import SHADOW_MASK, Capture, FitOptions, MaterialEntry, PhotoEntry
from .section import Section

# Of the contract, but not read by this version: refused by name instead of as unknown
LIGHTS_TO_COME = ("sphere", "sun", "position", "mounted", "white", "intensity")


WINDOWS_DEVICES = {
    "CON",
    "PRN",
    "AUX",
    "NUL",
    *(f"{n}{i}" for n in ("COM", "LPT") for i in range(10)),
}
LARGEST_FILE = 1_000_000  # bytes; a capture of a thousand photos has a tenth of it
LONGEST_LINE = 10_000


def read_capture(path: Path) -> Capture:
    """The capture in a file. Raises InputError naming the key and the line."""
    text = _text(path)
    try:
        data = tomllib.loads(text)
    except tomllib.TOMLDecodeError as error:
        raise InputError(f"is not valid TOML ({error})", file=path) from error
    except (ValueError, RecursionError) as error:  # a number or a nest beyond all bounds
        raise InputError(f"is not a capture file ({error})", file=path) from error
    lines = key_lines(text)
    top = Section(data, path.resolve(), lines)

    scan = top.table("scan")
    cameras, mesh = scan.file_path("cameras"), scan.file_path("mesh")
    images = scan.optional_file_path("images")
    if images is not None and not images.is_dir():
        raise scan.error(f"expected a folder, found a file: {images}", "images")
    scan.close()
    lights = tuple(_light(section) for section in top.tables("light"))
    materials = tuple(_material(section) for section in top.tables("material"))
    _refuse_twins(top, "light", [light.name for light in lights])
    _refuse_twins(top, "material", [material.name for material in materials])
    known = [light.irradiance is not None for light in lights]
    if any(known) and not all(known):
        place = known.index(False)
        raise top.error(
            "the irradiance is missing here and given for other lights: give all or none",
            "light",
            place,
            "irradiance",
        )
    photos = tuple(
        _photo(section, {light.name for light in lights}, {m.name for m in materials})
        for section in top.tables("photo")
    )
    _refuse_doubles(top, materials, {name for photo in photos for name in photo.masks})
    fit = _fit(top.table("fit"))
    top.table("diagnose").close()
    top.close()
    if not photos:
        raise top.error("no [[photo]]: at least one lit photo is needed", "photo")
    return Capture(
        file=path.resolve(),
        cameras=cameras,
        mesh=mesh,
        images=images,
        lights=lights,
        photos=photos,
        materials=materials or (MaterialEntry("surface"),),
        fit=fit,
        lines=lines,
    )


def _text(path: Path) -> str:
    try:
        if path.stat().st_size > LARGEST_FILE:
            raise InputError("is too large for a capture file", file=path)
        text = path.read_text("utf-8-sig")
    except (OSError, ValueError) as error:
        if isinstance(error, UnicodeDecodeError):
            raise InputError("is not a text in UTF-8", file=path) from error
        reason = getattr(error, "strerror", None) or error
        raise InputError(f"cannot be read ({reason})", file=path) from error
    if max(map(len, text.splitlines()), default=0) > LONGEST_LINE:
        raise InputError("has a line too long for a capture file", file=path)
    return text


def _refuse_twins(top: Section, kind: str, names: list[str]) -> None:
    for place, name in enumerate(names):
        # some file systems do not tell upper from lower case
        if name.casefold() in [other.casefold() for other in names[:place]]:
            raise top.error(f"the name {name!r} is used twice", kind, place, "name")


def _light(section: Section) -> DistantLight:
    name = section.text("name")
    for key in LIGHTS_TO_COME:
        if section.get(key) is not None:
            raise section.error(
                f"a light by {key!r} is not read by this version; give direction and irradiance",
                key,
            )
    direction = section.vector("direction")
    if direction is None:
        raise section.error("the key 'direction' is missing", "direction")
    length = float(np.linalg.norm(direction))
    if length < 1e-9:
        raise section.error("the direction has no length", "direction")
    irradiance = section.vector("irradiance", "red, green, blue")
    if irradiance is not None and not (irradiance > 0).all():
        raise section.error(f"found {irradiance.tolist()}, expected positive numbers", "irradiance")
    section.close()
    return DistantLight(name, direction / length, irradiance)


def _material(section: Section) -> MaterialEntry:
    name = section.text("name")
    faces = section.optional_text("faces")
    section.close()
    if name == SHADOW_MASK:
        raise section.error(f"{SHADOW_MASK!r} is the name of the shadow masks", "name")
    if not _is_file_name(name):
        raise section.error(f"{name[:60]!r} cannot be part of a file name everywhere", "name")
    return MaterialEntry(name, faces)


def _is_file_name(name: str) -> bool:
    """True for what Linux, macOS and Windows all take as the start of a file's name."""
    return (
        name.isprintable()
        and len(name.encode()) <= 100
        and not any(c in name for c in '/\\:*?"<>|')
        and name.strip(". ") == name
        and name.split(".")[0].upper() not in WINDOWS_DEVICES
    )


def _refuse_doubles(top: Section, materials: tuple[MaterialEntry, ...], masked: set[str]) -> None:
    """Two materials that are both all of the object: the artist forgot the masks."""
    whole = [i for i, m in enumerate(materials) if m.faces is None and m.name not in masked]
    if len(whole) > 1:
        raise top.error(
            f"{materials[whole[0]].name!r} and {materials[whole[1]].name!r} would both be all of "
            "the object: give them masks or faces",
            "material",
            whole[1],
            "name",
        )


def _photo(section: Section, lights: set[str], materials: set[str]) -> PhotoEntry:
    file, camera, light = (
        section.file_path("file"), section.text("camera"), section.text("light"),
    )  # fmt: skip
    exposure = section.number("exposure", 1.0, low=1e-12, high=1e12)
    entries = section.table("masks")
    masks = {}
    for name in entries.data:
        if name != SHADOW_MASK and name not in materials:
            raise entries.error(f"no [[material]] is named {name!r}", name)
        path = entries.file_path(name)
        masks[name] = path
    section.close()
    if light not in lights:
        known = ", ".join(sorted(lights)) or "none"
        raise section.error(f"no [[light]] is named {light!r}; there are: {known}", "light")
    return PhotoEntry(file, camera, light, exposure, masks)


def _fit(section: Section) -> FitOptions:
    margins, paper = Margins(), PaperSettings()
    curvature = section.number("curvature", paper.curvature or 0.0, low=0.0)
    samples = section.integer("samples", paper.samples, 1, 40)
    subset = section.integer("subset", paper.subset, 10, 1_000_000)
    if subset < 2 * samples:
        raise section.error(f"found {subset}, expected at least twice the samples", "subset")
    options = FitOptions(
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
            eta=section.number("eta", paper.eta, 0.0),
            seed=section.integer("seed", paper.seed, 0),
        ),
        held_out=section.flag("held_out", True),
    )
    section.close()
    return options
