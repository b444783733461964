"""What the panels of all stages have in common: what is there, what is missing, what to press."""

from __future__ import annotations

import bpy

from ..scene.session.running_job import running
from ..scene.views.workflow_stages import next_stage, stages
from .wrapped import wrapped

DONE, NOW, LATER = "CHECKMARK", "PLAY", "RADIOBUT_OFF"
LARGE = 1.4  # of the one button to press next


class StagePanel:
    """Subclasses are panels with a ``stage``, and say more in draw_more."""

    bl_space_type = "VIEW_3D"
    bl_region_type = "UI"
    bl_category = "Patina"
    stage = ""

    def draw_header(self, context: bpy.types.Context) -> None:
        found = stages(context.scene)
        now = next_stage(found) == self.stage
        self.layout.label(icon=DONE if found[self.stage].done else NOW if now else LATER)

    def draw(self, context: bpy.types.Context) -> None:
        layout, scene = self.layout, context.scene
        job = running(scene)
        if job is not None and job.panel == self.stage:
            layout.progress(text=job.said, factor=job.fraction, type="BAR")
            layout.label(text="ESC cancels", icon="CANCEL")
            return
        found = stages(scene)
        mine = found[self.stage]
        for line in mine.has:
            wrapped(layout, line, "BLANK1")
        if mine.missing is not None:
            wrapped(layout, mine.missing, "INFO")
        if mine.press and not mine.done:
            row = layout.row()
            if next_stage(found) == self.stage:
                row.scale_y = LARGE
            row.operator(mine.press)
        elif mine.again:
            layout.operator(mine.press, text=mine.again, icon="FILE_REFRESH")
        self.draw_more(layout, context)

    def draw_more(self, layout: bpy.types.UILayout, context: bpy.types.Context) -> None:
        """Below the button that is to be pressed."""
