"""Patina's data in a .blend: scene properties, and results in text data-blocks."""

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
    """A cause that a check found; ``name`` is its identifier."""

    use: bpy.props.BoolProperty(  # type: ignore[valid-type]
        name="Include in Model",
        description="Correct the samples for this effect before the materials are fitted",
        default=True,
    )


class PatinaScene(bpy.types.PropertyGroup):
    """Scene.patina."""

    capture: bpy.props.StringProperty(  # type: ignore[valid-type]
        name="Capture",
        description="Capture file with scan, lit photos and lights (*.capture.toml)",
        subtype="FILE_PATH",
    )
    mesh: bpy.props.PointerProperty(  # type: ignore[valid-type]
        name="Scanned Mesh",
        description="Mesh that the measured materials are assigned to",
        type=bpy.types.Object,
        poll=lambda self, candidate: candidate.type == "MESH",
    )
    use_slots: bpy.props.BoolProperty(  # type: ignore[valid-type]
        name="Fit These Materials",
        description="Fit one material for each material slot of the scanned mesh, instead of the "
        "materials of the capture file",
    )
    varying: bpy.props.EnumProperty(  # type: ignore[valid-type]
        name="Varying",
        description="Whether a fit estimates how colour, gloss and normals vary over the surface",
        items=(
            ("auto", "Automatic", "Where photos that were held out are predicted better with it"),
            ("always", "Always", "For all materials, without a comparison with held-out photos"),
            ("never", "Never", "Every material has one BRDF over its whole surface"),
        ),
        default="auto",
    )
    causes: bpy.props.CollectionProperty(type=PatinaCause)  # type: ignore[valid-type]


def store_result(capture: str, description: dict[str, Any], kind: str = RESULT) -> None:
    """Store the result of a fit or a check in the .blend, as one text data-block per capture and
    kind.

    description: the content of result.json or diagnosis.json; kind: RESULT or DIAGNOSIS.
    """
    text = result_text(capture, kind) or bpy.data.texts.new(kind)
    text[CAPTURE] = capture
    text.clear()
    text.write(json.dumps(description, indent=1))
    text.use_fake_user = True


def stored_result(capture: str, kind: str = RESULT) -> dict[str, Any] | None:
    """The stored result of the last fit or check of a capture, or None. The object is cached and
    must not be changed."""
    text = result_text(capture, kind)
    return None if text is None else _parsed(text.as_string())


@lru_cache(maxsize=8)  # panels read it at every redraw
def _parsed(text: str) -> dict[str, Any] | None:
    try:
        found = json.loads(text)
    except ValueError:  # the user has edited the text
        return None
    return found if isinstance(found, dict) else None


def capture_path(scene: bpy.types.Scene) -> str:
    """Absolute path of the scene's capture file, "" if there is none."""
    path = scene.patina.capture
    return str(Path(bpy.path.abspath(path)).resolve()) if path else ""


def result_text(capture: str, kind: str = RESULT) -> bpy.types.Text | None:
    """The text data-block with the result of the last fit or check of a capture, or None."""
    own = (t for t in bpy.data.texts if t.get(CAPTURE) == capture)
    return next((t for t in own if t.name.startswith(kind)), None)


register, unregister = register_property_factory(
    bpy.types.Scene, "patina", PatinaCause, PatinaScene
)
