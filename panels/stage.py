"""Base class of the stage panels: what is present, what is missing, and the next button."""

from __future__ import annotations

import bpy

from ..scene.session.running_job import running
from ..scene.views.workflow_stages import next_stage, stages
from .wrapped import wrapped

DONE, DOUBTFUL, NOW, LATER = "CHECKMARK", "ERROR", "PLAY", "RADIOBUT_OFF"
NEXT_BUTTON_SCALE = 1.4  # height of the button to press next, in button heights


class StagePanel:
    """Mixin for panels. Subclasses set ``stage`` and may add content in draw_more."""

    bl_space_type = "VIEW_3D"
    bl_region_type = "UI"
    bl_category = "Patina"
    bl_translation_context = "Patina"  # Blender has other meanings of some labels
    stage = ""

    def draw_header(self, context: bpy.types.Context) -> None:
        found = stages(context.scene)
        now = next_stage(found) == self.stage
        own = found[self.stage]
        done = DOUBTFUL if own.doubts else DONE
        self.layout.label(icon=done if own.done else NOW if now else LATER)

    def draw(self, context: bpy.types.Context) -> None:
        layout, scene = self.layout, context.scene
        job = running(scene)
        if job is not None and job.panel == self.stage:
            layout.progress(text=job.text, factor=job.fraction, type="BAR")
            layout.label(text="Press ESC to cancel", icon="CANCEL")
            layout = layout.column()
            layout.enabled = False  # kept: a shorter panel would lose the scroll position
        found = stages(scene)
        own = found[self.stage]
        for line in own.has:
            wrapped(layout, line, "BLANK1")
        for line in own.doubts:
            wrapped(layout, line, DOUBTFUL)
        if own.remedy:
            row = layout.row()
            row.scale_y = NEXT_BUTTON_SCALE
            row.operator(own.remedy)
        if own.missing is not None:
            wrapped(layout, own.missing, "INFO")
        if own.press and not own.done:
            row = layout.row()
            if next_stage(found) == self.stage:
                row.scale_y = NEXT_BUTTON_SCALE
            row.operator(own.press)
        elif own.again:
            row = layout.row()
            if own.outdated:
                row.scale_y = NEXT_BUTTON_SCALE
            row.operator(own.press, text=own.again, icon="FILE_REFRESH")
        self.draw_more(layout, context)

    def draw_more(self, layout: bpy.types.UILayout, context: bpy.types.Context) -> None:
        """Draw further content below the stage's button."""
