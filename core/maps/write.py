"""Maps as image files (base colour, roughness, factors, shares, coverage) and maps.json."""

from __future__ import annotations

import json
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Literal

import numpy as np
from numpy.typing import NDArray

from ..files import as_file_name, write_text_atomic
from ..photo import write_png
from ..photo.image import write_exr
from ..photo.transfer import srgb_encoded
from .dilate import dilated, margin_of
from .level import MaterialLevel
from .maps_result import MapsResult
from .settle import MaterialMaps

Format = Literal["exr", "png"]
BLEND = "blend"  # NAME of the maps that blend all materials
PHOTO_STEP = 25  # grey levels of coverage.png for each photo
MAX_ERROR = 0.5  # relative error that is white in uncertainty.png
MAX_ROUGHNESS = MAX_SPECULAR = 1.0  # of the inputs of a Principled BSDF
FORMAT = 1  # version of maps.json


@dataclass(frozen=True)
class MapFile:
    """A written map. material: its name, BLEND, or "" for the whole mesh; kind: base_color,
    roughness …; colour: True if the values are colours (sRGB in a PNG, linear in an EXR)."""

    material: str
    kind: str
    file: str
    colour: bool


def write_maps(
    folder: Path, result: MapsResult, kind: Format, colours: Format | None = None
) -> list[MapFile]:
    """Write all maps of a result and maps.json into ``folder``. kind: their file format; colours:
    that of colours, if it is another one."""
    files = []
    for map_file, values, fill in _maps(result, kind, colours or kind):
        _write(folder / map_file.file, result, values, fill, map_file.colour)
        files.append(map_file)
    _write_json(folder / "maps.json", result, files)
    return files


def base_color(result: MapsResult, index: int) -> NDArray[np.float32]:
    """(n, 3) base colour of the fitted Principled BSDF, linear, 0 … 1, times the scale of the
    diffuse body. Of a metal, the base colour is that of all light that it reflects."""
    fitted, own = result.materials[index].principled, result.maps.materials[index]
    factor, split = own.scale, result.levels[index].split
    if not split.whole and fitted.metallic > 0:
        all_light = split.all_light(own.scale, own.specular)
        factor = factor + np.float32(fitted.metallic) * (all_light - factor)
    return np.clip(np.asarray(fitted.base_color, np.float32) * factor, 0.0, 1.0)


def roughness(result: MapsResult, index: int) -> NDArray[np.float32]:
    """(n,) roughness (square root of α) of the fitted Principled BSDF with the gloss map."""
    fitted = result.materials[index].principled.roughness
    return _rougher(result.maps.materials[index], float(fitted))


def specular(result: MapsResult, index: int) -> NDArray[np.float32]:
    """(n,) Specular IOR Level of the fitted Principled BSDF times the factor of the specular part
    in its brightest channel; the others are darker by specular_tint."""
    fitted = float(result.materials[index].principled.specular_ior_level)
    factor = result.maps.materials[index].specular.max(axis=1)
    return np.clip(fitted * factor, 0.0, MAX_SPECULAR).astype(np.float32)


def specular_tint(result: MapsResult, index: int) -> NDArray[np.float32]:
    """(n, 3) colour of the specular part, 0 … 1; its brightest channel is 1. That of a metal is in
    its base colour."""
    factor = result.maps.materials[index].specular
    tint = factor / factor.max(axis=1, keepdims=True)
    metallic = float(result.materials[index].principled.metallic)
    return np.asarray(tint + metallic * (1 - tint), np.float32)


def albedo(result: MapsResult, index: int) -> NDArray[np.float32]:
    """(n, 3) albedo of the diffuse body, π·D·scale; the base colour of a material that is scaled as
    a whole."""
    split = result.levels[index].split
    if split.whole:
        return base_color(result, index)
    return (np.pi * split.body * result.maps.materials[index].scale).astype(np.float32)


def _rougher(maps: MaterialMaps, fitted: float) -> NDArray[np.float32]:
    return np.clip(fitted * np.exp(0.5 * maps.gloss), 0.0, MAX_ROUGHNESS).astype(np.float32)


def _maps(
    result: MapsResult, kind: Format, colours_as: Format
) -> Iterator[tuple[MapFile, NDArray[np.float32], NDArray[np.floating] | float]]:
    """(file, values (n,) or (n, 3), fill value outside the faces) of each map."""
    several = len(result.materials) > 1
    stems = _file_stems([material.name for material in result.materials])
    for index, material in enumerate(result.materials):
        name = material.name

        def named(
            what: str, colour: bool, ending: str = "", name: str = name, stem: str = stems[index]
        ) -> MapFile:
            suffix = ending or (colours_as if colour else kind)
            return MapFile(name, what, f"{stem}_{what}.{suffix}", colour)

        colours = base_color(result, index)
        yield named("base_color", True), colours, _typical(result, index, colours)
        yield named("albedo", True), albedo(result, index), _typical(result, index, colours)
        shine = roughness(result, index)
        yield named("roughness", False), shine, float(material.principled.roughness)
        own = result.maps.materials[index]
        yield named("scale", False, ending="exr"), own.scale, 1.0
        yield named("roughness_scale", False, ending="exr"), np.exp(own.gloss), 1.0
        if (own.specular != 1).any():
            level = float(material.principled.specular_ior_level)
            yield named("specular", False), specular(result, index), level
            yield named("specular_scale", False, ending="exr"), own.specular, 1.0
            if own.has_coloured_highlights:
                yield named("specular_tint", True), specular_tint(result, index), 1.0
        if several:
            yield named("mask", False), result.maps.materials[index].share, 0.0
    if several:
        for what, values in _blended(result).items():
            colour = values.ndim == 2
            suffix = colours_as if colour else kind
            file = MapFile(BLEND, what, f"{BLEND}_{what}.{suffix}", colour)
            yield file, values, values.mean(axis=0)
    if result.normal is not None:
        flat = np.array([0.5, 0.5, 1.0], np.float32)
        file = MapFile("", "normal", f"normal.{kind}", False)
        yield file, 0.5 + 0.5 * result.normal, flat
    photos = np.clip(result.maps.photos * (PHOTO_STEP / 255), 0, 1).astype(np.float32)
    yield MapFile("", "coverage", "coverage.png", False), photos, 0.0
    error = np.clip(result.maps.error / MAX_ERROR, 0, 1)
    yield MapFile("", "uncertainty", "uncertainty.png", False), error, 1.0


def _file_stems(names: list[str]) -> list[str]:
    """The start of the names of each material's files: its name; with numbers where one name is the
    start of another, or BLEND, so that two files could have one name."""
    folded = [as_file_name(name) for name in names]
    clash = BLEND in folded or any(
        other.startswith(f"{name}_") for name in folded for other in folded
    )
    return [f"{i + 1:02d}_{name}" for i, name in enumerate(names)] if clash else names


def _typical(result: MapsResult, index: int, colours: NDArray[np.float32]) -> NDArray[np.floating]:
    """(3,) mean colour over the texels of this material; over all texels if it has none."""
    own = result.maps.material == index
    return colours[own].mean(axis=0) if own.any() else colours.mean(axis=0)


def _blended(result: MapsResult) -> dict[str, NDArray[np.float32]]:
    """Maps of a single Principled BSDF for the whole mesh: each input is the mean over the
    materials, weighted by their shares."""
    share = [maps.share for maps in result.maps.materials]
    found: dict[str, NDArray[np.float32]] = {}
    coloured = any(maps.has_coloured_highlights for maps in result.maps.materials)
    also = ("specular_tint",) if coloured else ()
    for what in ("base_color", "roughness", "metallic", "specular", *also):
        total: Any = 0.0
        for index, own in enumerate(share):
            principled = result.materials[index].principled
            if what == "base_color":
                total = total + own[:, None] * base_color(result, index)
            elif what == "roughness":
                total = total + own * roughness(result, index)
            elif what == "metallic":
                total = total + own * np.float32(principled.metallic)
            elif what == "specular_tint":
                total = total + own[:, None] * specular_tint(result, index)
            else:
                total = total + own * specular(result, index)
        found[what] = np.asarray(total, np.float32)
    return found


def _write(
    path: Path,
    result: MapsResult,
    values: NDArray[np.float32],
    fill: NDArray[np.floating] | float,
    colour: bool,
) -> None:
    texels = result.texels
    known = texels.image(np.ones(len(texels), bool), False)
    (image,), reached = dilated([texels.image(values)], known, margin_of(texels.size))
    image[~reached] = fill
    if path.suffix == ".png":
        shown = srgb_encoded(image) if colour else image
        write_png(path, np.round(255 * np.clip(shown, 0, 1)).astype(np.uint8))
    else:
        rgb = image if image.ndim == 3 else np.repeat(image[..., None], 3, axis=2)
        write_exr(path, rgb, half=True)


def _write_json(path: Path, result: MapsResult, files: list[MapFile]) -> None:
    text = json.dumps(describe(result, files), indent=1, allow_nan=False)
    write_text_atomic(path, text + "\n")


def describe(result: MapsResult, files: list[MapFile]) -> dict[str, Any]:
    """The content of maps.json."""
    maps, texels = result.maps, result.texels
    seen = maps.photos > 0
    return {
        "format": FORMAT,
        "capture": str(result.capture.file),
        "size": texels.size,
        "texels": len(texels),
        "overlapped": texels.overlapped,
        "faces_outside": texels.outside,
        "unwrapped": result.unwrapped,
        "seen": float(seen.mean()),
        "photos": {
            "median": float(np.median(maps.photos)),
            "percentile_10": float(np.percentile(maps.photos, 10)),
        },
        "standard_error": {
            "measure": "relative, of the base colour of texels that a photo sees lit",
            "median": float(np.median(maps.error[seen])),
            "percentile_90": float(np.percentile(maps.error[seen], 90)),
        },
        "highlight_seen": float(maps.highlight.mean()),
        "normals_turned": None if result.normal is None else _turned(result.normal[seen]),
        "materials": [_material(result, index) for index in range(len(result.materials))],
        "files": [vars(f) for f in files],
        "notes": list(result.notes),
    }


def _material(result: MapsResult, index: int) -> dict[str, Any]:
    level, maps = result.levels[index], result.maps
    own = maps.material == index
    seen = own & (maps.photos > 0)
    scale = maps.materials[index].scale[seen]
    low, middle, high = np.percentile(scale, (5, 50, 95), axis=0) if seen.any() else np.ones((3, 3))
    return {
        "name": level.name,
        "texels": int(own.sum()),
        "seen": int(seen.sum()),
        "varies": _varying_parts(level, maps.materials[index]),
        "diffuse_share": level.split.share,
        "diffuse_albedo": None if level.split.whole else (np.pi * level.split.body).tolist(),
        "base_color": np.asarray(result.materials[index].principled.base_color).tolist(),
        "scale": {
            "percentile_5": low.tolist(),
            "median": middle.tolist(),
            "percentile_95": high.tolist(),
        },
    }


def _varying_parts(level: MaterialLevel, maps: MaterialMaps) -> str:
    """What the maps of a material scale."""
    if level.split.whole:
        return "the whole reflectance"
    return "its diffuse part" if (maps.specular == 1).all() else "its diffuse and specular parts"


def _turned(normal: NDArray[np.float32]) -> dict[str, float]:
    """Angle in degrees between the normals of the map (n, 3) and the smooth normals of the mesh."""
    angle = np.degrees(np.arctan2(np.hypot(normal[:, 0], normal[:, 1]), normal[:, 2]))
    return {
        "median": float(np.median(angle)),
        "percentile_95": float(np.percentile(angle, 95)),
    }
