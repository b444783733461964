"""Show on the scanned mesh how its materials vary."""

from __future__ import annotations

import bpy

from ..core.views.surface_view import QUANTITIES
from ..scene.scan.variation_colours import painted_kinds
from ..scene.views.evidence_overlay import toggle_variation
from .check import has_scanned_mesh

LABELS = {
    "diffuse": "Diffuse", "specular": "Specular", "roughness": "Roughness", "normal": "Normals",
    "error": "Uncertainty",
}  # fmt: skip
ITEMS = [(kind, LABELS[kind], one.title) for kind, one in QUANTITIES.items()]


class PATINA_OT_show_variation(bpy.types.Operator):
    """Colour the scanned mesh by this quantity of its materials, with a legend in the viewport. \
Press again to return to the earlier shading"""

    bl_idname = "patina.show_variation"
    bl_label = "Show Variation"
    bl_options = {"REGISTER", "UNDO"}

    kind: bpy.props.EnumProperty(  # type: ignore[valid-type]
        name="Quantity",
        items=ITEMS,
    )

    @classmethod
    def poll(cls, context: bpy.types.Context) -> bool:
        if not has_scanned_mesh(cls, context):
            return False
        if not painted_kinds(context.scene.patina.mesh):
            cls.poll_message_set("The materials of the last fit are even")
            return False
        return True

    def execute(self, context: bpy.types.Context) -> set[str]:
        if toggle_variation(context.scene.patina.mesh, self.kind) is None:
            self.report({"WARNING"}, f"{LABELS[self.kind]} does not vary")
            return {"CANCELLED"}
        return {"FINISHED"}


register, unregister = bpy.utils.register_classes_factory((PATINA_OT_show_variation,))
