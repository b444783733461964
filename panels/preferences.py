"""The extension's page in Blender's preferences."""

from __future__ import annotations

from pathlib import Path

import bpy

from ..scene.material.file_cache import MB, cached_files
from ..scene.session.folders import cache_folder, own_folder
from ..scene.session.preferences import NO_UNIT, PACKAGE, Preferences

DEFAULTS = Preferences()
MARGIN = {"min": 0, "max": 100, "soft_max": 20, "subtype": "PIXEL"}
OVERRIDE_NOTE = "Used if the capture file sets no value"


class PatinaPreferences(bpy.types.AddonPreferences):
    """Patina's preferences. scene/session/preferences.py reads them under these names."""

    bl_idname = PACKAGE

    merl_folder: bpy.props.StringProperty(  # type: ignore[valid-type]
        name="MERL Files",
        description="Folder of your own copy of the MERL database (100 .binary files; research and "
        "academic use). Materials are then fitted in a basis of the original measurements, which "
        "is computed once. If empty, the basis included with Patina is used",
        subtype="DIR_PATH",
        default=DEFAULTS.merl_folder,
    )
    cache_folder: bpy.props.StringProperty(  # type: ignore[valid-type]
        name="Cache Folder",
        description="Folder for bases of your own MERL files, and for shader textures and "
        "undistorted photos of .blend files that are not saved yet. If empty, the system's cache "
        "folder is used",
        subtype="DIR_PATH",
        default=DEFAULTS.cache_folder,
    )
    cache_size: bpy.props.IntProperty(  # type: ignore[valid-type]
        name="Maximum Size (MB)",
        description="If the cache is larger, the oldest files are removed when a .blend is opened "
        "and after a fit, except those that the open .blend uses",
        min=0,
        max=1_000_000,
        soft_min=100,
        soft_max=100_000,
        default=DEFAULTS.cache_size,
    )
    silhouette: bpy.props.IntProperty(  # type: ignore[valid-type]
        name="Margin at Outlines",
        description="Width in pixels that is excluded along outlines of the mesh. "
        f"{OVERRIDE_NOTE} (silhouette_margin)",
        default=DEFAULTS.silhouette,
        **MARGIN,
    )
    shadow: bpy.props.IntProperty(  # type: ignore[valid-type]
        name="Margin at Shadow Edges",
        description="Width in pixels that is excluded along the edges of shadows. "
        f"{OVERRIDE_NOTE} (shadow_margin)",
        default=DEFAULTS.shadow,
        **MARGIN,
    )
    mask: bpy.props.IntProperty(  # type: ignore[valid-type]
        name="Margin at Masks",
        description="Width in pixels that is excluded along the borders of painted masks. "
        f"{OVERRIDE_NOTE} (mask_margin)",
        default=DEFAULTS.mask,
        **MARGIN,
    )
    cosine: bpy.props.FloatProperty(  # type: ignore[valid-type]
        name="Minimum Cosine",
        description="Pixels are excluded if the cosine of light or view with the normal is smaller "
        "(0.1 is an angle of 84°), because small errors of the mesh have a large effect there. "
        f"{OVERRIDE_NOTE} (smallest_cosine)",
        min=0.001,
        max=0.99,
        default=DEFAULTS.cosine,
        precision=3,
    )
    unit: bpy.props.EnumProperty(  # type: ignore[valid-type]
        name="Scan Unit",
        description="Length of one unit of your scans, used to show lengths in the sidebar",
        items=[
            (NO_UNIT, "Unknown", "Show lengths in scan units"),
            ("METRES", "Metre", "One scan unit is a metre"),
            ("CENTIMETRES", "Centimetre", "One scan unit is a centimetre"),
            ("MILLIMETRES", "Millimetre", "One scan unit is a millimetre"),
        ],
        default=DEFAULTS.unit,
    )

    def draw(self, context: bpy.types.Context) -> None:
        """Draw the preferences page."""
        layout = self.layout
        layout.use_property_split = True
        layout.use_property_decorate = False
        layout.prop(self, "unit")
        layout.prop(self, "merl_folder")
        if self.merl_folder and not Path(bpy.path.abspath(self.merl_folder)).is_dir():
            layout.label(
                text="The folder does not exist; fits will fail until you choose another or none",
                icon="ERROR",
            )
        margins = layout.column()
        for name in ("silhouette", "shadow", "mask", "cosine"):
            margins.prop(self, name)
        column = layout.column()
        column.prop(self, "cache_folder")
        column.prop(self, "cache_size")
        files = cached_files()
        usage = f"Files: {len(files)}, {sum(files.values()) / MB:,.0f} MB"
        row = column.row()
        row.label(text=usage, icon="FILE_CACHE")
        row.operator("patina.empty_cache", icon="TRASH")
        for folder in dict.fromkeys((cache_folder(), own_folder())):
            column.label(text=str(folder), icon="FILE_FOLDER")


register, unregister = bpy.utils.register_classes_factory((PatinaPreferences,))
