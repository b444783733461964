"""Patina: measured materials from photo scans.

Blender calls ``register``; Python programs find the functions of ``api.py`` here. Both parts are
imported on first use.
"""

from __future__ import annotations

import importlib
from types import ModuleType
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from .api import (
        DEMO_CAPTURE,
        FORMATS,
        Angles,
        Capture,
        DiagnosisResult,
        Finding,
        FitResult,
        InputError,
        MaterialResult,
        PatinaError,
        PhotoErrors,
        PhotoPrediction,
        ProposedPhoto,
        Step,
        diagnose,
        export,
        fit,
        half_difference,
        load_capture,
        predict,
        select_photos,
    )

__all__ = [
    "DEMO_CAPTURE",
    "FORMATS",
    "Angles",
    "Capture",
    "DiagnosisResult",
    "Finding",
    "FitResult",
    "InputError",
    "MaterialResult",
    "PatinaError",
    "PhotoErrors",
    "PhotoPrediction",
    "ProposedPhoto",
    "Step",
    "diagnose",
    "export",
    "fit",
    "half_difference",
    "load_capture",
    "predict",
    "select_photos",
]

# Every module that has something to register, in this order; unregistered in reverse order
MODULES: tuple[str, ...] = (
    "panels.translations",
    "panels.manual",
    "panels.preferences",
    "scene.session.scene_properties",
    "scene.session.session_state",
    "scene.session.child_processes",
    "scene.photos.photo_list",
    "scene.scan.capture_draft",
    "scene.scan.orientation",
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
    "scene.views.outdated",
    "scene.views.evidence_overlay",
    "scene.export.export_choice",
    "operators.import_capture",
    "operators.new_capture",
    "operators.draft.add_files",
    "operators.draft.find_cameras",
    "operators.draft.edit_lamps",
    "operators.draft.create_capture",
    "operators.solve",
    "operators.drop",
    "operators.masks",
    "operators.paint",
    "operators.fit",
    "operators.check",
    "operators.look_through",
    "operators.explain_scan_quality",
    "operators.show_proposed_photo",
    "operators.save_lights",
    "operators.find_lights",
    "operators.find_ball",
    "operators.mark_assets",
    "operators.reset_traits",
    "operators.export",
    "operators.views",
    "operators.variation",
    "operators.empty_cache",
    "operators.menus",
    "panels.draft_box",
    "panels.sidebar",
    "panels.views_box",
    "panels.traits_box",
    "panels.export_box",
)


def __getattr__(name: str) -> Any:
    """Import a name of the Python API on first use; ``__version__`` comes from the manifest."""
    if name == "__version__":
        result_json = importlib.import_module(".core.report.result_json", __package__)
        return result_json.program_version()
    if name not in __all__:
        raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
    value = getattr(importlib.import_module(".api", __package__), name)
    globals()[name] = value
    return value


def __dir__() -> list[str]:
    return sorted({*globals(), *__all__, "__version__"})


def _modules() -> list[ModuleType]:
    return [importlib.import_module(f".{name}", __package__) for name in MODULES]


def register() -> None:
    """Add operators, panels, properties and handlers to Blender."""
    for module in _modules():
        module.register()


def unregister() -> None:
    """Remove everything that ``register`` added."""
    for module in reversed(_modules()):
        module.unregister()
