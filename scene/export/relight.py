"""Render fitted materials under new lighting: a sphere for each, and the scanned object on a
turntable.

Cycles renders the measured BRDF (OSL), if this build of Blender can run it, lit by environment
images.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path

import bpy
from mathutils import Matrix, Vector

from ...core.errors import InputError, PatinaError
from ...core.export.subject import Subject
from ...core.report.relit import Picture
from ...core.result import FittedResult
from ..material.lamp_inputs import update_lamps
from ..material.material_nodes import osl_missing
from ..material.world_inputs import update_worlds
from . import export_scene

HEIGHT = math.radians(15)  # elevation of the camera above the turntable
LENS = 85.0  # mm on a sensor of 36
MARGIN = 1.08  # frame size over object size
SPHERE = (96, 192)  # rings, segments


@dataclass(frozen=True)
class Quality:
    """Render settings.

    size: side of a picture, pixels; samples: per pixel; turns: pictures per full turn of the
    object, 0 for none; denoise: use Open Image Denoise, if this build of Blender has it.
    """

    size: int = 512
    samples: int = 128
    turns: int = 12
    denoise: bool = True


def shipped_worlds() -> dict[str, Path]:
    """Name → file of the environment images that are included with Blender."""
    folder = bpy.utils.system_resource("DATAFILES", path="studiolights/world")
    if not folder:
        return {}
    return {file.stem: file for file in sorted(Path(folder).glob("*.exr"))}


def find_worlds(names: Sequence[str]) -> dict[str, Path]:
    """Name → file of the environment images that ``--world`` requests.

    names: files, names of Blender's own images, or "all" for all of Blender's. Raises InputError
    for anything else.
    """
    shipped, found = shipped_worlds(), {}
    for name in names:
        if name == "all":
            found |= shipped
        elif name in shipped:
            found[name] = shipped[name]
        elif Path(name).is_file():
            found[Path(name).stem] = Path(name).resolve()
        else:
            raise InputError(
                f"{name!r} is neither a file nor an environment image of this Blender, which has "
                f"{', '.join(shipped) or 'none'}; expected one of those, a .hdr or .exr file, or "
                "all",
                key="--world",
            )
    if not found:
        raise InputError(
            "this Blender includes no environment images; give a .hdr or .exr file", key="--world"
        )
    return found


def relight(
    folder: Path,
    result: FittedResult,
    subjects: Sequence[Subject],
    worlds: dict[str, Path],
    quality: Quality,
) -> Iterator[tuple[float, Picture | None]]:
    """Render into ``folder``; yields (fraction done, the picture just rendered or None).

    Raises InputError for a world that is not an image, PatinaError if Blender cannot render.
    """
    spheres = len(subjects) * len(worlds)
    turns = quality.turns * len(worlds) if result.scene is not None else 0
    count, done = spheres + turns, 0
    export_scene.new_scene()
    made = export_scene.create_materials(subjects, whole=True, stack=osl_missing() is not None)
    scene = bpy.context.scene
    sphere = _sphere()
    _prepare(scene, quality)
    _camera(scene, Vector((0, 0, 0)), 1.0)
    for name, file in worlds.items():
        light_with(scene, file)
        for subject, material in zip(subjects, made, strict=True):
            yield done / count, None
            sphere.data.materials.clear()
            sphere.data.materials.append(material)
            target = Path(f"sphere_{subject.id}_{name}.png")
            _render(scene, folder / target)
            done += 1
            yield done / count, Picture(target, name, subject.name)
    if turns == 0 or result.scene is None:
        return
    mesh = export_scene.open_scan(result.scene, [s.name for s in subjects])
    if mesh is None:
        return
    scene = bpy.context.scene
    table, radius = _turntable(scene, mesh)
    _prepare(scene, quality)
    _camera(scene, Vector((0, 0, 0)), radius)
    for name, file in worlds.items():
        light_with(scene, file)
        for turn in range(quality.turns):
            yield done / count, None
            table.rotation_euler.z = 2 * math.pi * turn / quality.turns
            target = Path(f"turntable_{name}") / f"{turn:03d}.png"
            _render(scene, folder / target)
            done += 1
            yield done / count, Picture(target, name, "object", turn)


def _sphere() -> bpy.types.Object:
    mesh = bpy.data.meshes.new("sphere")
    export_scene.fill_sphere(mesh, *SPHERE)
    sphere = bpy.data.objects.new("sphere", mesh)
    bpy.context.scene.collection.objects.link(sphere)
    return sphere


def _turntable(scene: bpy.types.Scene, mesh: bpy.types.Object) -> tuple[bpy.types.Object, float]:
    """Put the object upright on an empty that turns around z, and remove all other objects.

    The mean up direction of the scan's cameras is taken as upright. Returns (the empty, the
    object's radius).
    """
    up = Vector((0, 0, 0))
    for item in list(scene.objects):
        if item.type == "CAMERA":
            up += item.matrix_world.to_3x3().col[1].normalized()
    up = up.normalized() if up.length > 1e-3 else Vector((0, 0, 1))
    for item in list(scene.objects):
        if item is not mesh:
            bpy.data.objects.remove(item)
    corners = [mesh.matrix_world @ Vector(c) for c in mesh.bound_box]
    centre = sum(corners, Vector((0, 0, 0))) / 8
    upright = up.rotation_difference(Vector((0, 0, 1))).to_matrix().to_4x4()
    table = bpy.data.objects.new("turntable", None)
    scene.collection.objects.link(table)
    placed = upright @ Matrix.Translation(-centre) @ mesh.matrix_world
    mesh.parent = table
    mesh.matrix_parent_inverse = Matrix.Identity(4)
    mesh.matrix_basis = placed
    mesh.hide_render = False
    bpy.context.view_layer.update()
    radius = max((placed @ Vector(c)).length for c in mesh.bound_box)
    return table, radius


def _prepare(scene: bpy.types.Scene, quality: Quality) -> None:
    if not hasattr(scene, "cycles"):
        raise PatinaError(
            "this build of Blender has no Cycles, which renders the measured BRDF; use a build "
            "from blender.org"
        )
    scene.render.engine = "CYCLES"
    cycles = scene.cycles
    cycles.device, cycles.samples, cycles.use_adaptive_sampling = "CPU", quality.samples, False
    if osl_missing() is None:
        cycles.shading_system = True
    cycles.use_denoising = quality.denoise and _can_denoise()
    cycles.transparent_max_bounces = max(
        cycles.transparent_max_bounces, 16
    )  # portals count as transparent bounces
    render = scene.render
    render.resolution_x = render.resolution_y = quality.size
    render.resolution_percentage = 100
    settings = render.image_settings
    if hasattr(settings, "media_type"):
        settings.media_type = "IMAGE"
    settings.file_format, settings.color_mode, settings.color_depth = "PNG", "RGB", "8"
    scene.view_settings.view_transform = "Standard"
    scene.view_settings.exposure = 0.0


def _can_denoise() -> bool:
    import _cycles

    return bool(getattr(_cycles, "with_openimagedenoise", False))


def _camera(scene: bpy.types.Scene, centre: Vector, radius: float) -> None:
    camera = bpy.data.objects.new("camera", bpy.data.cameras.new("camera"))
    camera.data.lens, camera.data.sensor_width = LENS, 36.0
    half = math.atan(18.0 / LENS)
    far = MARGIN * radius / math.sin(half)
    away = Vector((0, -math.cos(HEIGHT), math.sin(HEIGHT)))
    camera.location = centre + far * away
    camera.rotation_euler = away.to_track_quat("Z", "Y").to_euler()
    camera.data.clip_start, camera.data.clip_end = 0.01 * far, 10 * far
    scene.collection.objects.link(camera)
    scene.camera = camera


def light_with(scene: bpy.types.Scene, file: Path) -> None:
    """Light a scene by an environment image. Raises InputError if the file is not an image."""
    try:
        image = bpy.data.images.load(str(file), check_existing=True)
    except RuntimeError as error:
        raise InputError(
            f"cannot be read as an environment image ({error}); expected a .hdr or .exr file",
            file=file,
        ) from error
    if min(image.size) < 2:
        raise InputError(
            "cannot be read as an environment image; expected a .hdr or .exr file", file=file
        )
    world = bpy.data.worlds.new(file.stem)
    if world.node_tree is None:
        world.use_nodes = True
    tree = world.node_tree
    tree.nodes.clear()
    texture = tree.nodes.new("ShaderNodeTexEnvironment")
    texture.image = image
    background = tree.nodes.new("ShaderNodeBackground")
    output = tree.nodes.new("ShaderNodeOutputWorld")
    tree.links.new(texture.outputs["Color"], background.inputs["Color"])
    tree.links.new(background.outputs["Background"], output.inputs["Surface"])
    scene.world = world
    bpy.context.view_layer.update()
    update_lamps(scene)
    update_worlds(scene)


def _render(scene: bpy.types.Scene, file: Path) -> None:
    file.parent.mkdir(parents=True, exist_ok=True)
    scene.render.filepath = str(file.absolute())
    bpy.ops.render.render(write_still=True)
    if not file.is_file():
        raise PatinaError(f"{file.name}: Blender rendered nothing")
