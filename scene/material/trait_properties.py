"""The sliders of a measured material: Material.patina_traits."""

from __future__ import annotations

import bpy

from ..session.handlers import register_property_factory
from .measured_materials import measured_materials
from .trait_offsets import SLIDERS, movable
from .trait_update import update_material

MAX_OFFSET, SOFT_MAX_OFFSET = 10.0, 3.0  # slider range, standard deviations
CHANNEL_ITEMS = (
    ("every", "All", "Change red, green and blue together, which mostly keeps the hue"),
    ("red", "R", "Change only red, in addition to the change of all channels"),
    ("green", "G", "Change only green, in addition to the change of all channels"),
    ("blue", "B", "Change only blue, in addition to the change of all channels"),
)


def _changed(shifts: PatinaShifts, context: bpy.types.Context) -> None:
    update_material(shifts.id_data)


def _slider(number: int) -> bpy.types.FloatProperty:
    return bpy.props.FloatProperty(
        name=f"Component {number}",
        description=f"Offset of principal component {number} from the measured value, in standard "
        "deviations of the materials of the basis; 0 is as measured",
        soft_min=-SOFT_MAX_OFFSET,
        soft_max=SOFT_MAX_OFFSET,
        min=-MAX_OFFSET,
        max=MAX_OFFSET,
        step=10,
        precision=2,
        options=set(),  # not animatable: nothing would update the material
        update=_changed,
    )


class PatinaShifts(bpy.types.PropertyGroup):
    """Offsets of the components, of one channel or common to all."""

    trait_1: _slider(1)  # type: ignore[valid-type]
    trait_2: _slider(2)  # type: ignore[valid-type]
    trait_3: _slider(3)  # type: ignore[valid-type]
    trait_4: _slider(4)  # type: ignore[valid-type]
    trait_5: _slider(5)  # type: ignore[valid-type]
    trait_6: _slider(6)  # type: ignore[valid-type]
    trait_7: _slider(7)  # type: ignore[valid-type]
    trait_8: _slider(8)  # type: ignore[valid-type]


class PatinaTraits(bpy.types.PropertyGroup):
    """Material.patina_traits. The offset of all channels and that of a single channel add up."""

    channels: bpy.props.EnumProperty(  # type: ignore[valid-type]
        name="Channels",
        description="Colour channels that the sliders below change",
        items=CHANNEL_ITEMS,
        options=set(),
    )
    every: bpy.props.PointerProperty(type=PatinaShifts)  # type: ignore[valid-type]
    red: bpy.props.PointerProperty(type=PatinaShifts)  # type: ignore[valid-type]
    green: bpy.props.PointerProperty(type=PatinaShifts)  # type: ignore[valid-type]
    blue: bpy.props.PointerProperty(type=PatinaShifts)  # type: ignore[valid-type]


def shown_material(context: bpy.types.Context) -> bpy.types.Material | None:
    """The material whose sliders are shown: the active material of the active object if it is
    measured, else that of the scanned mesh, else the first measured material."""
    for thing in (context.object, context.scene.patina.mesh):
        material = getattr(thing, "active_material", None)
        if material is not None and movable(material):
            return material
    return next((m for m in measured_materials() if movable(m)), None)


def reset(material: bpy.types.Material) -> None:
    """Set every slider to 0 and update the material at once."""
    traits = material.patina_traits
    for name, *_ in CHANNEL_ITEMS:
        group = getattr(traits, name)
        for slider in SLIDERS:
            group.property_unset(slider)  # calls no update function; one call below is enough
    update_material(material, wholly=True)


register, unregister = register_property_factory(
    bpy.types.Material, "patina_traits", PatinaShifts, PatinaTraits
)
