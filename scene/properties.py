"""What Patina remembers in a .blend, on the scene."""

from __future__ import annotations

import json
from typing import Any

import bpy

TEXT_NAME = "Patina result"


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
    stage: bpy.props.StringProperty(options={"SKIP_SAVE", "HIDDEN"})  # type: ignore[valid-type]
    progress: bpy.props.FloatProperty(  # type: ignore[valid-type]
        name="Progress",
        subtype="FACTOR",
        min=0.0,
        max=1.0,
        options={"SKIP_SAVE"},
    )


def store_result(description: dict[str, Any]) -> None:
    """Keep a fit's description (result.json) in the .blend, as a text data-block."""
    text = bpy.data.texts.get(TEXT_NAME) or bpy.data.texts.new(TEXT_NAME)
    text.clear()
    text.write(json.dumps(description, indent=1))
    text.use_fake_user = True


def stored_result() -> dict[str, Any] | None:
    """The description of the last fit in this .blend, or None."""
    text = bpy.data.texts.get(TEXT_NAME)
    if text is None:
        return None
    try:
        found = json.loads(text.as_string())
    except ValueError:  # the artist typed into it
        return None
    return found if isinstance(found, dict) else None


def register() -> None:
    bpy.utils.register_class(PatinaScene)
    bpy.types.Scene.patina = bpy.props.PointerProperty(type=PatinaScene)


def unregister() -> None:
    del bpy.types.Scene.patina
    bpy.utils.unregister_class(PatinaScene)
