"""Which formats the artist wants the materials in, and which cannot be written now."""

from __future__ import annotations

import bpy

from ..session.handlers import register_property_factory
from ..session.last_fit import kept_fit
from ..session.scene_properties import capture_path, stored_result

RECORD, REPORT = "record", "report"
FORMATS: dict[str, tuple[str, str]] = {
    "gltf": (
        "glTF",
        "The scanned mesh for viewers and game engines (.glb): metallic-roughness with KHR "
        "extensions. Loses Diffuse Roughness, and the coat's index and tint",
    ),
    "usd": (
        "USD",
        "The scanned mesh (.usdc) with UsdPreviewSurface and, from Blender 5.0, MaterialX",
    ),
    "blend": (
        "Blender assets",
        "A .blend of the materials alone, marked as assets, with the EXRs of their OSL shader",
    ),
    "mtlx": ("MaterialX", "A stack of lobes and OpenPBR as .mtlx, without textures or geometry"),
    "mitsuba": (
        "Mitsuba 3",
        "Scenes with our plugin, which reads the measurement exactly, and with Mitsuba's own "
        "measured material",
    ),
    "pbrt": ("pbrt-v4", "A scene and the .bsdf that its measured material reads"),
    "binary": (
        "MERL table",
        "NAME.binary in the format of the MERL database, values at the cells' centres",
    ),
    "exr": ("EXR tables", "Table, coefficients and basis as 32-bit pictures, with a README"),
    "npz": ("NumPy tables", "The same as NumPy archives, with a README"),
    RECORD: (
        "Record",
        "result.json, and diagnosis.json where there was a check: all that was found, with its "
        "uncertainty, for programs",
    ),
    REPORT: (
        "Report",
        "A page with spheres, curves and every photo beside its prediction. Needs the photos of "
        "the fit: only as long as Blender runs after it",
    ),
}
"""Word → (name, what it holds). Most words are those of the command."""


def missing(scene: bpy.types.Scene, word: str) -> str | None:
    """Why a format cannot be written now; None where it can."""
    if word == REPORT:
        capture = capture_path(scene)
        if kept_fit(capture, stored_result(capture)) is None:
            return "The report needs the photos of the fit: fit again in this session"
    if word == "usd" and not bpy.app.build_options.usd:
        return "This Blender was built without USD; use one from blender.org"
    return None


class PatinaExport(bpy.types.PropertyGroup):
    """Scene.patina_export."""

    formats: bpy.props.EnumProperty(  # type: ignore[valid-type]
        name="Formats",
        description="What the materials are written as",
        items=[(word, name, holds) for word, (name, holds) in FORMATS.items()],
        options={"ENUM_FLAG"},
        default={"gltf"},
    )


register, unregister = register_property_factory(bpy.types.Scene, "patina_export", PatinaExport)
