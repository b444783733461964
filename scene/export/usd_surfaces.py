"""Replace the surfaces that Blender's USD exporter translated by surfaces fitted for the format.

The exporter writes the Principled BSDF's values into a UsdPreviewSurface and into OpenPBR, which
compute other BRDFs from them.
"""

from __future__ import annotations

import logging
import re
from collections.abc import Mapping
from dataclasses import dataclass, fields
from pathlib import Path
from typing import Any

import numpy as np

from ...core.appearance.open_pbr.model import OpenPBR
from ...core.appearance.principled import Principled

log = logging.getLogger(__name__)

PREVIEW_SHADER = "UsdPreviewSurface"
OPEN_PBR_SHADER = "ND_open_pbr_surface_surfaceshader"
MATERIALX_CONTEXT = "mtlx"


@dataclass(frozen=True)
class UsdSurfaces:
    """Fitted inputs of one material. preview: as a UsdPreviewSurface computes them."""

    preview: Principled
    open_pbr: OpenPBR


@dataclass(frozen=True)
class Replaced:
    """Names of the materials whose UsdPreviewSurface and whose OpenPBR have fitted inputs."""

    preview: frozenset[str]
    open_pbr: frozenset[str]


def replace_surfaces(path: Path, surfaces: Mapping[str, UsdSurfaces]) -> Replaced:
    """Write fitted inputs into the shaders of a USD file, by the materials' names in Blender.
    Shaders with textures keep their inputs. Without USD's Python module, which some builds of
    Blender lack, nothing is replaced."""
    try:
        from pxr import Usd, UsdShade
    except ImportError as error:
        log.warning("the surfaces of %s are as Blender exported them: %s", path.name, error)
        return Replaced(frozenset(), frozenset())
    stage = Usd.Stage.Open(str(path))
    by_prim = {prim_name: name for name in surfaces for prim_name in _prim_names(name)}
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
            if shader and shader.GetIdAttr().Get() == kind and _set_inputs(shader, values):
                names.add(name)
    stage.GetRootLayer().Save()
    return Replaced(frozenset(done[0]), frozenset(done[1]))


def _prim_names(name: str) -> set[str]:
    """Names that Blender may give to the prim of a material: characters that no identifier can hold
    become "_", in some versions also letters beyond ASCII."""
    plain = {re.sub(r"\W", "_", name), re.sub(r"\W", "_", name, flags=re.ASCII)}
    return {f"_{n}" if n[:1].isdigit() else n for n in plain}


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


def _open_pbr_inputs(surface: OpenPBR) -> dict[str, Any]:
    return {field.name: getattr(surface, field.name) for field in fields(surface)}
