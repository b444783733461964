"""Patina: measured materials from photo scans. This file only registers."""

from __future__ import annotations

import importlib
from types import ModuleType

# Every module that has something to register, in order; unregistered the other way round
MODULES: tuple[str, ...] = (
    "panels.preferences",
    "scene.session.scene_properties",
    "scene.session.session_state",
    "scene.photos.photo_list",
    "scene.paint.paint_properties",
    "scene.paint.swatches",
    "scene.paint.canvas",
    "scene.paint.brushes",
    "scene.paint.mask_images",
    "scene.material.osl_files",
    "scene.material.lamp_inputs",
    "scene.material.world_inputs",
    "scene.material.fallback",
    "scene.material.trait_properties",
    "scene.material.trait_update",
    "scene.material.file_cache",
    "scene.views.view_properties",
    "scene.export.export_choice",
    "operators.import_capture",
    "operators.new_capture",
    "operators.solve",
    "operators.drop",
    "operators.masks",
    "operators.paint",
    "operators.fit",
    "operators.check",
    "operators.look_through",
    "operators.save_lights",
    "operators.mark_assets",
    "operators.reset_traits",
    "operators.export",
    "operators.views",
    "operators.empty_cache",
    "panels.sidebar",
    "panels.views_box",
    "panels.traits_box",
    "panels.export_box",
)


def _modules() -> list[ModuleType]:
    return [importlib.import_module(f".{name}", __package__) for name in MODULES]


def register() -> None:
    """Add operators, panels, properties and handlers to Blender."""
    for module in _modules():
        module.register()


def unregister() -> None:
    """Take everything away again."""
    for module in reversed(_modules()):
        module.unregister()
