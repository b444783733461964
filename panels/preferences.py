"""The extension's own page in Blender's preferences."""

from __future__ import annotations

from pathlib import Path

import bpy

from ..scene.material.file_cache import MB, cached_files
from ..scene.session.folders import cache_folder, own_folder
from ..scene.session.preferences import NO_UNIT, PACKAGE, Preferences

USUAL = Preferences()
MARGIN = {"min": 0, "max": 100, "soft_max": 20, "subtype": "PIXEL"}
SAID = "Used where a capture file does not say it itself"


class PatinaPreferences(bpy.types.AddonPreferences):
    """Read by scene/session/preferences.py, whose names these are."""

    bl_idname = PACKAGE

    merl_folder: bpy.props.StringProperty(  # type: ignore[valid-type]
        name="MERL Files",
        description="Folder of your own copy of the MERL database (100 .binary files; research and "
        "academic use): materials are fitted in a basis of the genuine measurements, which is "
        "computed once. Empty: the basis that comes with Patina",
        subtype="DIR_PATH",
        default=USUAL.merl_folder,
    )
    cache_folder: bpy.props.StringProperty(  # type: ignore[valid-type]
        name="Cache Folder",
        description="For bases of your own MERL files, and for the shaders' pictures and "
        "straightened photos of .blend files that are not saved yet. Empty: the system's own place",
        subtype="DIR_PATH",
        default=USUAL.cache_folder,
    )
    cache_size: bpy.props.IntProperty(  # type: ignore[valid-type]
        name="Largest Size (MB)",
        description="Beyond it the oldest files are removed when a file is opened and after "
        "a fit, except those that the open file shows",
        min=0,
        max=1_000_000,
        soft_min=100,
        soft_max=100_000,
        default=USUAL.cache_size,
    )
    silhouette: bpy.props.IntProperty(  # type: ignore[valid-type]
        name="Left Out at Silhouettes",
        description=f"Pixels left out along outlines of the mesh. {SAID} (silhouette_margin)",
        default=USUAL.silhouette,
        **MARGIN,
    )
    shadow: bpy.props.IntProperty(  # type: ignore[valid-type]
        name="Left Out at Shadow Edges",
        description=f"Pixels left out along the edges of shadows. {SAID} (shadow_margin)",
        default=USUAL.shadow,
        **MARGIN,
    )
    mask: bpy.props.IntProperty(  # type: ignore[valid-type]
        name="Left Out at Masks",
        description=f"Pixels left out along the borders of painted masks. {SAID} (mask_margin)",
        default=USUAL.mask,
        **MARGIN,
    )
    cosine: bpy.props.FloatProperty(  # type: ignore[valid-type]
        name="Smallest Cosine",
        description="Of light and view with the normal: beyond (0.1 is 84°) a small error of the "
        f"mesh changes too much. {SAID} (smallest_cosine)",
        min=0.001,
        max=0.99,
        default=USUAL.cosine,
        precision=3,
    )
    unit: bpy.props.EnumProperty(  # type: ignore[valid-type]
        name="Scan Unit",
        description="What one unit of your scans is: lengths in the sidebar are told in it",
        items=[
            (NO_UNIT, "Unknown", "Lengths are told in scan units"),
            ("METRES", "Metre", "A scan unit is a metre"),
            ("CENTIMETRES", "Centimetre", "A scan unit is a centimetre"),
            ("MILLIMETRES", "Millimetre", "A scan unit is a millimetre"),
        ],
        default=USUAL.unit,
    )

    def draw(self, context: bpy.types.Context) -> None:
        """The page."""
        layout = self.layout
        layout.use_property_split = True
        layout.use_property_decorate = False
        layout.prop(self, "unit")
        layout.prop(self, "merl_folder")
        if self.merl_folder and not Path(bpy.path.abspath(self.merl_folder)).is_dir():
            layout.label(text="There is no such folder: fits will stop and say so", icon="ERROR")
        margins = layout.column()
        for name in ("silhouette", "shadow", "mask", "cosine"):
            margins.prop(self, name)
        column = layout.column()
        column.prop(self, "cache_folder")
        column.prop(self, "cache_size")
        files = cached_files()
        said = f"{len(files)} files, {sum(files.values()) / MB:,.0f} MB"
        row = column.row()
        row.label(text=said, icon="FILE_CACHE")
        row.operator("patina.empty_cache", icon="TRASH")
        for place in dict.fromkeys((cache_folder(), own_folder())):
            column.label(text=str(place), icon="FILE_FOLDER")


register, unregister = bpy.utils.register_classes_factory((PatinaPreferences,))
