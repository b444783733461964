"""The export formats that the user selects, and the reasons why one cannot be written."""

from __future__ import annotations

import bpy

from ...core.viewer.page import has_program
from ..session.handlers import register_property_factory
from ..session.last_fit import kept_fit
from ..session.scene_properties import capture_path, stored_result

RECORD, REPORT = "record", "report"
FORMATS: dict[str, tuple[str, str]] = {
    "gltf": (
        "glTF",
        "The scanned mesh for viewers and game engines (.glb): metallic-roughness with KHR "
        "extensions. Diffuse Roughness, Coat IOR and Coat Tint cannot be stored",
    ),
    "usd": (
        "USD",
        "The scanned mesh (.usdc) with UsdPreviewSurface and, from Blender 5.0, MaterialX",
    ),
    "blend": (
        "Blender Assets",
        "A .blend with only the materials, marked as assets, and the EXRs of their OSL shader",
    ),
    "mtlx": ("MaterialX", "A stack of lobes and OpenPBR as .mtlx, without textures or geometry"),
    "mitsuba": (
        "Mitsuba 3",
        "Scenes with Patina's plugin, which evaluates the measured BRDF exactly, and with the "
        "measured material of Mitsuba",
    ),
    "pbrt": ("pbrt-v4", "A scene and the .bsdf file of its measured material"),
    "web": (
        "Web Page",
        "viewer.html: the measured BRDF, the lobe stack and the Principled BSDF on a sphere, for "
        "any browser, without a network",
    ),
    "binary": (
        "MERL Table",
        "NAME.binary in the format of the MERL database, with values at the cell centres",
    ),
    "exr": ("EXR Tables", "Table, coefficients and basis as 32-bit images, with a README"),
    "npz": ("NumPy Tables", "Table, coefficients and basis as NumPy archives, with a README"),
    RECORD: (
        "Record",
        "All results with their uncertainty for use by programs: result.json, and diagnosis.json "
        "after a check",
    ),
    REPORT: (
        "Report",
        "A page with spheres, curves and every photo next to its prediction. It needs the photos "
        "of the fit, which are kept only until Blender is closed",
    ),
}
"""Identifier → (label, tooltip). Most identifiers are format names of the export command."""


def missing(scene: bpy.types.Scene, word: str) -> str | None:
    """Why a format cannot be written now; None if it can."""
    if word == REPORT:
        capture = capture_path(scene)
        if kept_fit(capture, stored_result(capture)) is None:
            return "The report needs the photos of the fit; fit again in this session"
    if word == "web" and not has_program():
        return "The program of the viewer was not built; use a zip of the extension"
    if word == "usd" and not bpy.app.build_options.usd:
        return "This build of Blender has no USD; use a build from blender.org"
    return None


class PatinaExport(bpy.types.PropertyGroup):
    """Scene.patina_export."""

    formats: bpy.props.EnumProperty(  # type: ignore[valid-type]
        name="Formats",
        description="File formats to write the materials in",
        items=[(word, name, holds) for word, (name, holds) in FORMATS.items()],
        options={"ENUM_FLAG"},
        default={"gltf"},
    )


register, unregister = register_property_factory(bpy.types.Scene, "patina_export", PatinaExport)
