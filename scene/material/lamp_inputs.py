"""Write the scene's lamps into the inputs of every Patina shader.

An OSL shader cannot query the lamps of Cycles, and light paths never hit a lamp without a size. The
shader therefore evaluates lamps itself, from a table in its hidden inputs
(assets/osl/patina_brdf.osl).
"""

from __future__ import annotations

import logging
import math
from dataclasses import dataclass

import bpy
from bpy.app.handlers import persistent

from ...core.appearance import osl_source
from ..session.handlers import register_handlers_factory
from .osl_files import own_shaders

log = logging.getLogger(__name__)

Vector3 = tuple[float, float, float]
OFF, SUN, POINT, AREA = range(4)
NO_CONE = -2.0  # cosine of a point lamp's cone, below every real cosine


@dataclass(frozen=True)
class Lamp:
    """One row of the table, in world space.

    kind: OFF, SUN, POINT or AREA, negative if the camera sees the lamp itself. at: direction
    surface → light for a sun, else the position. power: irradiance at normal incidence for a sun,
    else radiant intensity along the axis (W/sr). form: see lamp_light in the shader.
    """

    kind: int = OFF
    at: Vector3 = (0.0, 0.0, 0.0)
    power: Vector3 = (0.0, 0.0, 0.0)
    axis: Vector3 = (0.0, 0.0, 0.0)
    side: Vector3 = (0.0, 0.0, 0.0)
    form: Vector3 = (0.0, 0.0, 0.0)


def scene_lamps(scene: bpy.types.Scene) -> list[Lamp]:
    """Every lamp that is on in renders, brightest first."""
    rows = [_row(o) for o in _rendered(scene.collection) if o.type == "LIGHT"]
    return sorted((r for r in rows if max(r.power) > 0), key=lambda r: (-max(r.power), r.at))


def _rendered(collection: bpy.types.Collection) -> set[bpy.types.Object]:
    """All objects of a collection and its children that are not hidden in renders."""
    if collection.hide_render:
        return set()
    found = {o for o in collection.objects if not o.hide_render}
    return found.union(*(_rendered(child) for child in collection.children))


def update_lamps(scene: bpy.types.Scene) -> int:
    """Write the lamps into all Patina materials; returns the number of changed inputs.

    If the scene has more lamps than the shader supports, the brightest are used and a warning is
    logged.
    """
    nodes = own_shaders()
    if not nodes:
        return 0
    lamps = scene_lamps(scene)
    if len(lamps) > osl_source.LAMPS:
        log.warning(
            "The scene has %d lamps; Patina shaders use the %d brightest.",
            len(lamps),
            osl_source.LAMPS,
        )
    rows = [*lamps, *[Lamp()] * osl_source.LAMPS][: osl_source.LAMPS]
    return sum(_write(node, rows) for node in nodes)


def _write(node: bpy.types.Node, rows: list[Lamp]) -> int:
    """Write only inputs that differ: every write makes Cycles compile the shader again."""
    sockets = {socket.identifier: socket for socket in node.inputs}
    changed = 0
    for i, lamp in enumerate(rows):
        for part in ("kind", "at", "power", "axis", "side", "form"):
            socket = sockets.get(f"lamp{i + 1}_{part}")
            if socket is None:
                continue
            value = getattr(lamp, part)
            if part == "kind":
                if socket.default_value != value:
                    socket.default_value, changed = value, changed + 1
                continue
            old = tuple(socket.default_value)[:3]
            if any(abs(a - b) > 1e-6 * (1 + abs(b)) for a, b in zip(old, value, strict=True)):
                socket.default_value = (*value, 1.0) if part == "power" else value
                changed += 1
    return changed


def _row(lamp_object: bpy.types.Object) -> Lamp:
    """A lamp as Cycles renders it, converted from Blender's units to those of the table."""
    lamp, world = lamp_object.data, lamp_object.matrix_world
    shown = -1 if lamp_object.visible_camera else 1
    rotation = world.to_3x3().normalized()
    beam = tuple(-rotation.col[2])  # lamps shine along their -z
    at = tuple(world.translation)
    watts = lamp_power(lamp)
    if lamp.type == "SUN":
        form = (math.tan(lamp.angle / 2), 0.0, 0.0)
        return Lamp(shown * SUN, tuple(rotation.col[2]), watts, beam, form=form)
    if lamp.type == "AREA":
        return _area(lamp, world, at, beam, watts, shown)
    intensity = tuple(w / (4 * math.pi) for w in watts)
    cone, edge = NO_CONE, 0.0
    if lamp.type == "SPOT":
        cone = math.cos(lamp.spot_size / 2)
        edge = (1 - cone) * lamp.spot_blend
    return Lamp(shown * POINT, at, intensity, beam, form=(lamp.shadow_soft_size, cone, edge))


def _area(lamp, world, at, beam, watts, shown) -> Lamp:  # type: ignore[no-untyped-def]
    height = lamp.size_y if lamp.shape in {"RECTANGLE", "ELLIPSE"} else lamp.size
    round_shape = lamp.shape in {"DISK", "ELLIPSE"}
    side = world.to_3x3() @ type(world.translation)((lamp.size / 2, 0, 0))
    half = (world.to_3x3() @ type(world.translation)((0, height / 2, 0))).length
    # a Lambertian emitter: intensity along its normal is power / π, however large it is
    intensity = tuple(w / math.pi for w in watts)
    return Lamp(shown * AREA, at, intensity, beam, tuple(side), (half, float(round_shape), 0.0))


def lamp_power(lamp: bpy.types.Light) -> Vector3:
    """Strength × colour, linear RGB, including exposure and temperature of newer versions."""
    strength = lamp.energy * 2.0 ** getattr(lamp, "exposure", 0.0)
    tint = (1.0, 1.0, 1.0)
    if getattr(lamp, "use_temperature", False):
        tint = tuple(lamp.temperature_color)[:3]
    return tuple(strength * c * t for c, t in zip(lamp.color, tint, strict=True))


@persistent
def _after_update(scene: bpy.types.Scene, depsgraph: bpy.types.Depsgraph) -> None:
    """Update the lamp inputs if a lamp changed. The update changes only materials, so it does not
    trigger itself."""
    for update in depsgraph.updates:
        data = update.id
        if (
            isinstance(data, bpy.types.Light)
            or (isinstance(data, bpy.types.Object) and data.type == "LIGHT")
            or isinstance(data, bpy.types.Collection | bpy.types.Scene)
        ):
            update_lamps(scene)
            return


@persistent
def _before_render(scene: bpy.types.Scene, *_: object) -> None:
    update_lamps(scene)


HANDLERS = (("depsgraph_update_post", _after_update), ("render_pre", _before_render))
register, unregister = register_handlers_factory(HANDLERS)
