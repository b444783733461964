"""The scene's lamps, written into the inputs of every Patina shader.

A shader cannot ask Cycles for lamps, and the paths that leave it never meet one without a size: the
shader evaluates them itself, from a table in its hidden inputs (assets/osl/patina_brdf.osl).
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
NO_CONE = -2.0  # a point lamp: below any cosine


@dataclass(frozen=True)
class Lamp:
    """One row of the table, in world space; see lamp_light in the shader for what form holds.

    at: surface → light for a sun, else a position. power: irradiance at normal incidence for a
    sun, else radiant intensity along the axis (W/sr). kind is negative where the lamp itself
    shows in the picture.
    """

    kind: int = OFF
    at: Vector3 = (0.0, 0.0, 0.0)
    power: Vector3 = (0.0, 0.0, 0.0)
    axis: Vector3 = (0.0, 0.0, 0.0)
    side: Vector3 = (0.0, 0.0, 0.0)
    form: Vector3 = (0.0, 0.0, 0.0)


def scene_lamps(scene: bpy.types.Scene) -> list[Lamp]:
    """Every lamp that shines in the render, brightest first."""
    rows = [_row(o) for o in _rendered(scene.collection) if o.type == "LIGHT"]
    return sorted((r for r in rows if max(r.power) > 0), key=lambda r: (-max(r.power), r.at))


def _rendered(collection: bpy.types.Collection) -> set[bpy.types.Object]:
    """The objects below a collection that are not hidden in renders, by themselves or with it."""
    if collection.hide_render:
        return set()
    found = {o for o in collection.objects if not o.hide_render}
    return found.union(*(_rendered(child) for child in collection.children))


def update_lamps(scene: bpy.types.Scene) -> int:
    """Write the lamps into all Patina materials; returns how many inputs changed.

    A scene holds more than the shader can take: the brightest count, and a warning says so.
    """
    nodes = own_shaders()
    if not nodes:
        return 0
    lamps = scene_lamps(scene)
    if len(lamps) > osl_source.LAMPS:
        log.warning("%d lamps: Patina shaders take the %d brightest", len(lamps), osl_source.LAMPS)
    rows = [*lamps, *[Lamp()] * osl_source.LAMPS][: osl_source.LAMPS]
    return sum(_write(node, rows) for node in nodes)


def _write(node: bpy.types.Node, rows: list[Lamp]) -> int:
    """Touch only what differs: every write makes Cycles build the shader anew."""
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
    """What Cycles makes of a lamp: the light's own units, turned into the table's."""
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
    """Strength × colour, linear RGB, with what newer versions add (exposure, temperature)."""
    strength = lamp.energy * 2.0 ** getattr(lamp, "exposure", 0.0)
    tint = (1.0, 1.0, 1.0)
    if getattr(lamp, "use_temperature", False):
        tint = tuple(lamp.temperature_color)[:3]
    return tuple(strength * c * t for c, t in zip(lamp.color, tint, strict=True))


@persistent
def _after_update(scene: bpy.types.Scene, depsgraph: bpy.types.Depsgraph) -> None:
    """Cheap while nothing happens to lamps; a write here changes materials only, so no loop."""
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
