"""What is painted with, and how it is shown."""

from __future__ import annotations

import bpy

from ...core.errors import PatinaError
from ..session.handlers import register_property_factory
from ..session.scene_properties import capture_path
from .canvas import take_strokes


def _draw_anew(state: PatinaPaint, context: bpy.types.Context) -> None:
    scene = state.id_data
    try:
        take_strokes(scene, capture_path(scene))  # and draws
    except PatinaError:  # a slider cannot say so: the next button does
        return


class PatinaPaint(bpy.types.PropertyGroup):
    """Scene.patina_paint."""

    active: bpy.props.IntProperty(  # type: ignore[valid-type]
        name="Paint", description="What the brushes paint", min=0
    )
    opacity: bpy.props.FloatProperty(  # type: ignore[valid-type]
        name="Opacity",
        description="How much of the colours is seen over the photo that is painted on",
        subtype="FACTOR",
        min=0.1,
        max=1.0,
        default=0.5,
        update=_draw_anew,
    )


register, unregister = register_property_factory(bpy.types.Scene, "patina_paint", PatinaPaint)
