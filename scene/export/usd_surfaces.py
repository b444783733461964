"""Replace the surfaces that Blender's USD exporter translated by surfaces fitted for the format.

The exporter writes the Principled BSDF's values into a UsdPreviewSurface and into OpenPBR, which
compute other BRDFs from them.
"""

from __future__ import annotations

import importlib.util
import re
from collections import Counter
from collections.abc import Collection, Mapping
from dataclasses import dataclass, fields
from pathlib import Path
from typing import Any

import bpy
import numpy as np

from ...core.appearance.open_pbr.model import OpenPBR
from ...core.appearance.principled import Principled

PREVIEW_SHADER = "UsdPreviewSurface"
OPEN_PBR_SHADER = "ND_open_pbr_surface_surfaceshader"
MATERIALX_CONTEXT = "mtlx"


@dataclass(frozen=True)
class UsdSurfaces:
    """Fitted inputs of one material. preview: as a UsdPreviewSurface computes them; open_pbr: None
    where Blender writes no OpenPBR."""

    preview: Principled
    open_pbr: OpenPBR | None


@dataclass(frozen=True)
class Replaced:
    """Names of the materials whose UsdPreviewSurface and whose OpenPBR have fitted inputs."""

    preview: frozenset[str]
    open_pbr: frozenset[str]


def can_replace() -> bool:
    """Whether this build of Blender has USD's Python module (some have not)."""
    if hasattr(bpy.utils, "expose_bundled_modules"):  # the bpy module hides it until then
        bpy.utils.expose_bundled_modules()
    return importlib.util.find_spec("pxr") is not None


def replace_surfaces(
    path: Path, surfaces: Mapping[str, UsdSurfaces], exported: Collection[str]
) -> Replaced:
    """Write fitted inputs into the shaders of a USD file, by the materials' names in Blender.

    exported: names of all materials in the file. Shaders with textures keep their inputs, and so do
    materials whose identifier in USD could be that of another one. Needs ``can_replace``.
    """
    from pxr import Usd, UsdShade

    stage = Usd.Stage.Open(str(path))
    claims = Counter(prim for name in {*exported, *surfaces} for prim in prim_names(name))
    by_prim = {prim: name for name in surfaces for prim in prim_names(name) if claims[prim] == 1}
    done: tuple[set[str], set[str]] = (set(), set())
    for prim in stage.Traverse():
        name = by_prim.get(prim.GetName())
        if name is None or not prim.IsA(UsdShade.Material):
            continue
        fitted = surfaces[name]
        kinds = (
            ("", PREVIEW_SHADER, _preview_inputs(fitted.preview)),
            (MATERIALX_CONTEXT, OPEN_PBR_SHADER, _open_pbr_inputs(fitted.open_pbr)),
        )
        for (context, kind, values), names in zip(kinds, done, strict=True):
            shader = UsdShade.Material(prim).ComputeSurfaceSource(context)[0]
            if (
                values
                and shader
                and shader.GetIdAttr().Get() == kind
                and _set_inputs(shader, values)
            ):
                names.add(name)
    stage.GetRootLayer().Save()
    return Replaced(frozenset(done[0]), frozenset(done[1]))


def prim_names(name: str) -> set[str]:
    """Identifiers that Blender may give to a material: what none can hold becomes "_". Blender 4.2
    replaces every byte beyond ASCII, later versions keep letters of all languages."""
    of_bytes = re.sub(rb"[^A-Za-z0-9_]", b"_", name.encode()).decode()
    of_letters = "".join(c if f"a{c}".isidentifier() else "_" for c in name)
    found = set()
    for plain in (of_bytes, of_letters):
        found |= {f"_{plain}", f"_{plain[1:]}"} if plain[:1].isdigit() else {plain}
    return found


def _set_inputs(shader: Any, values: Mapping[str, Any]) -> bool:
    """Set the inputs of a shader; False if one of them has a texture."""
    from pxr import Gf, Sdf

    present = {i.GetBaseName(): i for i in shader.GetInputs()}
    if any(name in present and present[name].HasConnectedSource() for name in values):
        return False
    for name, value in values.items():
        colour = np.ndim(value) > 0
        kind = Sdf.ValueTypeNames.Color3f if colour else Sdf.ValueTypeNames.Float
        made = shader.CreateInput(name, kind)
        made.Set(Gf.Vec3f(*(float(v) for v in value)) if colour else float(value))
    return True


def _preview_inputs(principled: Principled) -> dict[str, Any]:
    return {
        "diffuseColor": principled.base_color,
        "metallic": principled.metallic,
        "roughness": principled.roughness,
        "ior": principled.ior,
        "clearcoat": principled.coat_weight,
        "clearcoatRoughness": principled.coat_roughness,
    }


def _open_pbr_inputs(surface: OpenPBR | None) -> dict[str, Any]:
    if surface is None:
        return {}
    return {field.name: getattr(surface, field.name) for field in fields(surface)}
