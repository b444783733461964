"""The pages of the documentation that Blender's Online Manual opens for Patina's buttons and
settings (right click). The zips of the extension contain the site (tools/manual.py)."""

from __future__ import annotations

import contextlib
from pathlib import Path

import bpy

FOLDER = Path(__file__).parents[1] / "assets" / "manual"

PAGES: dict[str, tuple[str, ...]] = {
    "guide/sidebar.html#a-new-capture": (
        "bpy.ops.patina.new_capture*",
        "bpy.ops.patina.add_files*",
        "bpy.ops.patina.cancel_draft*",
        "bpy.ops.patina.create_capture*",
        "bpy.types.patinadraft.*",
        "bpy.types.patinadraftphoto.*",
        "bpy.types.patinadraftcamera.*",
    ),
    "guide/solve.html": (
        "bpy.ops.patina.solve_draft*",
        "bpy.ops.patina.solve_photos*",
        "bpy.ops.patina.localise_draft*",
    ),
    "guide/lights.html#lamps-in-blender": (
        "bpy.ops.patina.draft_lamps*",
        "bpy.ops.patina.save_lights*",
        "bpy.types.patinadraftlamp.*",
    ),
    "guide/lights.html#found-from-the-photos": ("bpy.ops.patina.find_lights*",),
    "guide/lights.html#a-sphere": ("bpy.ops.patina.find_ball*",),
    "guide/sidebar.html#dropping-files-onto-a-3d-viewport": ("bpy.ops.patina.drop_photos*",),
    "guide/first-material.html#in-ten-minutes": (
        "bpy.ops.patina.import_capture*",
        "bpy.ops.patina.import_demo*",
    ),
    "guide/sidebar.html#orientation": ("bpy.types.patinaorientation.*",),
    "guide/masks.html#in-blender": (
        "bpy.ops.patina.add_material*",
        "bpy.ops.patina.remove_material*",
        "bpy.ops.patina.paint_mesh*",
        "bpy.ops.patina.paint_photo*",
        "bpy.ops.patina.pick_paint*",
        "bpy.ops.patina.take_paint*",
        "bpy.ops.patina.export_masks*",
        "bpy.ops.patina.slots_from_face_sets*",
        "bpy.types.patinapaint.*",
    ),
    "guide/masks.html#shadow-masks": ("bpy.ops.patina.shadow_masks*",),
    "guide/masks.html#proposed-materials": ("bpy.ops.patina.propose_materials*",),
    "guide/report.html#the-proposed-photo": ("bpy.ops.patina.show_proposed_photo*",),
    "method/diagnosis.html": (
        "bpy.ops.patina.check*",
        "bpy.ops.patina.refit*",
        "bpy.ops.patina.explain_scan_quality*",
        "bpy.types.patinacause.*",
    ),
    "guide/sidebar.html#evidence-on-the-mesh": ("bpy.ops.patina.show_evidence*",),
    "guide/maps.html": ("bpy.ops.patina.show_variation*",),
    "guide/views.html": (
        "bpy.ops.patina.show_chart*",
        "bpy.ops.patina.look_through_photo*",
        "bpy.ops.patina.look_at_photo*",
        "bpy.ops.patina.next_photo*",
        "bpy.ops.patina.lamp_shading*",
        "bpy.types.patinaviews.*",
        "bpy.types.patinaphoto.*",
        "bpy.types.patinaphotos.*",
    ),
    "guide/traits.html": (
        "bpy.ops.patina.reset_traits*",
        "bpy.types.patinatraits.*",
        "bpy.types.patinashifts.*",
    ),
    "guide/sidebar.html#export": (
        "bpy.ops.patina.export",
        "bpy.ops.patina.add_export_preset*",
        "bpy.ops.patina.mark_assets*",
        "bpy.types.patinaexport.*",
    ),
    "guide/sidebar.html#preferences": (
        "bpy.ops.patina.empty_cache*",
        "bpy.types.patinapreferences.*",
    ),
    "guide/sidebar.html#during-a-job": ("bpy.ops.patina.fit*",),
    "guide/sidebar.html": ("bpy.ops.patina.*", "bpy.types.patina*"),
}
"""Page → patterns of the names that Blender looks up, in lower case; the first match counts."""


def pages() -> tuple[str, tuple[tuple[str, str], ...]]:
    """(start of the addresses, (pattern, page) in the order of the search), as Blender's
    ``register_manual_map`` expects them."""
    found = [(pattern, page) for page, patterns in PAGES.items() for pattern in patterns]
    return f"{FOLDER.as_uri()}/", tuple(found)


def register() -> None:
    """Add the pages to the Online Manual. A checkout without a built site has none."""
    if FOLDER.is_dir():
        bpy.utils.register_manual_map(pages)


def unregister() -> None:
    """Remove the pages from the Online Manual."""
    with contextlib.suppress(ValueError):  # they were not added
        bpy.utils.unregister_manual_map(pages)
