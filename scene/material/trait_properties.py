"""The sliders of a measured material: Material.patina_traits."""

from __future__ import annotations

import bpy

from ..session.handlers import register_property_factory
from .measured_materials import measured_materials
from .trait_offsets import SLIDERS, movable
from .trait_update import follow

FAR, SOFT = 10.0, 3.0  # deviations
CHANNEL_ITEMS = (
    ("every", "All", "Move red, green and blue together: the hue mostly stays"),
    ("red", "R", "Move red alone, on top of what all channels are moved by"),
    ("green", "G", "Move green alone, on top of what all channels are moved by"),
    ("blue", "B", "Move blue alone, on top of what all channels are moved by"),
)


def _changed(shifts: PatinaShifts, context: bpy.types.Context) -> None:
    follow(shifts.id_data)


def _slider(number: int) -> bpy.types.FloatProperty:
    return bpy.props.FloatProperty(
        name=f"Component {number}",
        description=f"Added to the measured material's principal component {number}, in standard "
        "deviations of the materials that the components were made from; 0: as measured",
        soft_min=-SOFT,
        soft_max=SOFT,
        min=-FAR,
        max=FAR,
        step=10,
        precision=2,
        options=set(),  # no keyframes: nothing would follow them
        update=_changed,
    )


class PatinaShifts(bpy.types.PropertyGroup):
    """What is added to each component; of one channel, or of all."""

    trait_1: _slider(1)  # type: ignore[valid-type]
    trait_2: _slider(2)  # type: ignore[valid-type]
    trait_3: _slider(3)  # type: ignore[valid-type]
    trait_4: _slider(4)  # type: ignore[valid-type]
    trait_5: _slider(5)  # type: ignore[valid-type]
    trait_6: _slider(6)  # type: ignore[valid-type]
    trait_7: _slider(7)  # type: ignore[valid-type]
    trait_8: _slider(8)  # type: ignore[valid-type]


class PatinaTraits(bpy.types.PropertyGroup):
    """Material.patina_traits. The sliders of all channels and of a single one add up."""

    channels: bpy.props.EnumProperty(  # type: ignore[valid-type]
        name="Channels",
        description="Which of the material's color channels the sliders below move",
        items=CHANNEL_ITEMS,
        options=set(),
    )
    every: bpy.props.PointerProperty(type=PatinaShifts)  # type: ignore[valid-type]
    red: bpy.props.PointerProperty(type=PatinaShifts)  # type: ignore[valid-type]
    green: bpy.props.PointerProperty(type=PatinaShifts)  # type: ignore[valid-type]
    blue: bpy.props.PointerProperty(type=PatinaShifts)  # type: ignore[valid-type]


def shown_material(context: bpy.types.Context) -> bpy.types.Material | None:
    """The material whose sliders are shown: the active object's active one where it is measured,
    else that of the scanned mesh, else the first that is."""
    for thing in (context.object, context.scene.patina.mesh):
        material = getattr(thing, "active_material", None)
        if material is not None and movable(material):
            return material
    return next((m for m in measured_materials() if movable(m)), None)


def reset(material: bpy.types.Material) -> None:
    """Every slider to 0, and all as measured, at once."""
    traits = material.patina_traits
    for name, *_ in CHANNEL_ITEMS:
        group = getattr(traits, name)
        for slider in SLIDERS:
            group.property_unset(slider)  # calls no update: one is enough
    follow(material, wholly=True)


register, unregister = register_property_factory(
    bpy.types.Material, "patina_traits", PatinaShifts, PatinaTraits
)
