"""What Patina remembers in a .blend, on the scene."""

from __future__ import annotations

import json
from functools import lru_cache
from pathlib import Path
from typing import Any

import bpy

from ..property_keys import CAPTURE
from .handlers import register_property_factory

RESULT, DIAGNOSIS = "Patina result", "Patina diagnosis"  # names of texts


class PatinaCause(bpy.types.PropertyGroup):
    """A cause that a check named; ``name`` is the word of the vocabulary."""

    use: bpy.props.BoolProperty(  # type: ignore[valid-type]
        name="Take into Account",
        description="Rid the samples of this before the materials are fitted to them",
        default=True,
    )


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
        name="Fit These Materials",
        description="Fit one material to each material slot of the scanned mesh, instead of those "
        "of the capture file",
    )
    causes: bpy.props.CollectionProperty(type=PatinaCause)  # type: ignore[valid-type]


def store_result(capture: str, description: dict[str, Any], kind: str = RESULT) -> None:
    """Keep what a fit (or a check) found in the .blend, as result.json (diagnosis.json) has it: one
    text data-block a capture and kind."""
    text = _text(capture, kind) or bpy.data.texts.new(kind)
    text[CAPTURE] = capture
    text.clear()
    text.write(json.dumps(description, indent=1))
    text.use_fake_user = True


def stored_result(capture: str, kind: str = RESULT) -> dict[str, Any] | None:
    """What the last fit (or check) of that capture in this .blend found, or None. Not to be
    changed: who asks again is given the same."""
    text = _text(capture, kind)
    return None if text is None else _parsed(text.as_string())


@lru_cache(maxsize=8)  # panels ask at every redraw
def _parsed(text: str) -> dict[str, Any] | None:
    try:
        found = json.loads(text)
    except ValueError:  # the artist typed into it
        return None
    return found if isinstance(found, dict) else None


def capture_path(scene: bpy.types.Scene) -> str:
    """The scene's capture file as an absolute path, "" where there is none."""
    told = scene.patina.capture
    return str(Path(bpy.path.abspath(told)).resolve()) if told else ""


def _text(capture: str, kind: str) -> bpy.types.Text | None:
    mine = (t for t in bpy.data.texts if t.get(CAPTURE) == capture)
    return next((t for t in mine if t.name.startswith(kind)), None)


register, unregister = register_property_factory(
    bpy.types.Scene, "patina", PatinaCause, PatinaScene
)
