"""What Patina remembers in a .blend, on the scene."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import bpy

TEXT_NAME = "Patina result"
CAPTURE = "patina_capture"  # on whatever was made from a capture: the file, absolute


class PatinaScene(bpy.types.PropertyGroup):
    """Scene.patina."""

    capture: bpy.props.StringProperty(  # type: ignore[valid-type]
        name="Capture",
        description="The capture file: which scan, which lit photos, which light (*.capture.toml)",
        subtype="FILE_PATH",
    )
    mesh: bpy.props.PointerProperty(  # type: ignore[valid-type]
        name="Scanned Mesh",
        description="The mesh that the measured materials are put on",
        type=bpy.types.Object,
        poll=lambda self, candidate: candidate.type == "MESH",
    )
    use_slots: bpy.props.BoolProperty(  # type: ignore[valid-type]
        name="Fit Slots",
        description="Fit one material to each material slot of the scanned mesh, instead of those "
        "of the capture file",
    )


def store_result(capture: str, description: dict[str, Any]) -> None:
    """Keep a fit's description (result.json) in the .blend, one text data-block a capture."""
    text = _text(capture) or bpy.data.texts.new(TEXT_NAME)
    text[CAPTURE] = capture
    text.clear()
    text.write(json.dumps(description, indent=1))
    text.use_fake_user = True


def stored_result(capture: str) -> dict[str, Any] | None:
    """The description of the last fit of that capture in this .blend, or None."""
    text = _text(capture)
    if text is None:
        return None
    try:
        found = json.loads(text.as_string())
    except ValueError:  # the artist typed into it
        return None
    return found if isinstance(found, dict) else None


def capture_path(scene: bpy.types.Scene) -> str:
    """The scene's capture file as an absolute path, "" where there is none."""
    told = scene.patina.capture
    return str(Path(bpy.path.abspath(told)).resolve()) if told else ""


def _text(capture: str) -> bpy.types.Text | None:
    return next((t for t in bpy.data.texts if t.get(CAPTURE) == capture), None)


def register() -> None:
    bpy.utils.register_class(PatinaScene)
    bpy.types.Scene.patina = bpy.props.PointerProperty(type=PatinaScene)


def unregister() -> None:
    del bpy.types.Scene.patina
    bpy.utils.unregister_class(PatinaScene)
