"""Scene.patina_paint: the active paint and the opacity of canvases."""

from __future__ import annotations

import bpy

from ...core.errors import PatinaError
from ..session.handlers import register_property_factory
from ..session.scene_properties import capture_path
from .canvas import apply_photo_strokes


def _redraw(state: PatinaPaint, context: bpy.types.Context) -> None:
    scene = state.id_data
    try:
        apply_photo_strokes(scene, capture_path(scene))  # draws the canvases, too
    except PatinaError:  # a slider cannot report errors; the next operator does
        return


class PatinaPaint(bpy.types.PropertyGroup):
    """Scene.patina_paint."""

    active: bpy.props.IntProperty(  # type: ignore[valid-type]
        name="Paint", description="Material or mask that the brushes paint", min=0
    )
    opacity: bpy.props.FloatProperty(  # type: ignore[valid-type]
        name="Opacity",
        description="Opacity of the colours over the photo that you paint on",
        subtype="FACTOR",
        min=0.1,
        max=1.0,
        default=0.5,
        update=_redraw,
    )


register, unregister = register_property_factory(bpy.types.Scene, "patina_paint", PatinaPaint)
