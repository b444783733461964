"""Change Traits panel, below Material & Export: sliders that edit a measured material."""

from __future__ import annotations

import math

import bpy

from ..scene.material.trait_offsets import (
    measured_brdf,
    movable,
    plausibility,
    slider_labels,
    sliders,
    state,
)
from ..scene.material.trait_properties import shown_material
from ..scene.material.trait_update import outdated_pieces
from ..scene.property_keys import BASIS_VERSION
from .measured_box import SPHERE, icon_of
from .wrapped import wrapped


class PATINA_PT_traits(bpy.types.Panel):
    bl_idname = "PATINA_PT_traits"
    bl_label = "Change Traits"
    bl_space_type = "VIEW_3D"
    bl_region_type = "UI"
    bl_category = "Patina"
    bl_translation_context = "Patina"  # Blender has other meanings of some labels
    bl_parent_id = "PATINA_PT_material"
    bl_options = {"DEFAULT_CLOSED"}

    @classmethod
    def poll(cls, context: bpy.types.Context) -> bool:
        return shown_material(context) is not None

    def draw(self, context: bpy.types.Context) -> None:
        layout, material = self.layout, shown_material(context)
        _choice(layout, context, material)
        layout.template_icon(icon_value=icon_of(material), scale=SPHERE)
        if measured_brdf(material) is None:
            message = (
                "The basis of this material is not on this computer; fit again to edit the material"
            )
            wrapped(layout, message, "ERROR")
            return
        traits = material.patina_traits
        layout.row().prop(traits, "channels", expand=True)
        column, shifts = layout.column(align=True), getattr(traits, traits.channels)
        for number, (name, word) in enumerate(
            zip(sliders(material), slider_labels(material[BASIS_VERSION]), strict=False), 1
        ):
            column.prop(shifts, name, text=f"{number} {word.capitalize()}", slider=True)
        for line, icon in notes(material):
            wrapped(layout, line, icon)
        layout.operator("patina.reset_traits", icon="LOOP_BACK")


def _choice(
    layout: bpy.types.UILayout, context: bpy.types.Context, material: bpy.types.Material
) -> None:
    """Draw the material's name, and a list of the mesh's materials if it has several."""
    mesh = context.scene.patina.mesh
    if mesh is not None and len(mesh.material_slots) > 1 and context.object in (None, mesh):
        layout.template_list(
            "MATERIAL_UL_matslots",
            "",
            mesh,
            "material_slots",
            mesh,
            "active_material_index",
            rows=2,
        )
    layout.label(text=material.name, icon="MATERIAL")


def status_label(material: bpy.types.Material, portable: bool) -> str:
    """The status of a material in the list. portable: whether the measured shader cannot run."""
    if movable(material) and state(material):
        return "Changed"
    return "Portable" if portable else "Measured"


def notes(material: bpy.types.Material) -> list[tuple[str, str]]:
    """(sentence, icon) pairs: warnings and notes about the edited material."""
    lines = []
    found = plausibility(material)
    if found.excess is not None:
        albedo, view = found.excess
        where = "along the normal" if view < 0.1 else f"{math.degrees(view):.0f}° from the normal"
        lines.append(
            (f"Viewed {where}, the albedo is {albedo:.2g}, which is not physical; renders limit "
             "it to 1", "ERROR")
        )  # fmt: skip
    if not state(material):
        return lines
    if found.beyond:
        listed = ", ".join(str(i + 1) for i in found.beyond)
        lines.append(
            (f"Outside the range of the measured materials: component {listed}",
             "INFO")
        )  # fmt: skip
    if outdated_pieces(material):
        lines.append(("Updating EEVEE and exports…", "SORTTIME"))
    return lines


register, unregister = bpy.utils.register_classes_factory((PATINA_PT_traits,))
