"""Make the photos of a shoot without cameras: a textured object in Cycles, in even light and lit.

    python -m tools.make_textured_shoot FOLDER      (with the bpy wheel)

FOLDER/scan: photos around the object in even light, on a patterned cloth. FOLDER/lit: photos in the
dark under one of four lamps each, most from viewpoints of the scan, two from new ones. Hidden files
hold the truth: `.truth.json` (poses, lamps), `.surface.npz` (the mesh as stereo would find it).
"""

from __future__ import annotations

import argparse
import json
from pathlib import Path

import bpy
import numpy as np
from mathutils import Matrix, Vector

WIDTH, HEIGHT, LENS = 1000, 750, 45.0  # pixels; mm on 36 mm film
SCAN_PHOTOS, DISTANCE = 30, 6.5
HEIGHTS = (0.25, 0.7)  # of the viewpoints, over their distance
LAMPS = ((0.6, -0.3, 0.75), (-0.7, 0.1, 0.7), (0.1, 0.75, 0.65), (0.2, -0.9, 0.4))
LIT_VIEWS = (1, 5, 9, 13, 17, 21)  # photos of the scan with the viewpoint of a lit photo
NEW_VIEWS = (0.4, 3.3)  # azimuths of the lit photos from new viewpoints, radians
MESH_ERROR = 0.8  # degrees, median of the normals
SAMPLES = 12


def main() -> None:
    """Render everything."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("folder", type=Path)
    folder = parser.parse_args().folder
    thing, cloth = _scene()
    truth: dict[str, object] = {"lamps": LAMPS, "centres": {}, "lit": {}}
    sun = bpy.data.objects["lamp"]
    for index in range(SCAN_PHOTOS):
        place = _ring(2 * np.pi * index / SCAN_PHOTOS, HEIGHTS[index % 2])
        _world(1.0)
        sun.hide_render, cloth.hide_render = True, False
        name = f"scan_{index:02d}.jpg"
        _render(folder / "scan" / name, place)
        truth["centres"][name] = list(place)
    views = [(f"scan_{k:02d}", 2 * np.pi * k / SCAN_PHOTOS, HEIGHTS[k % 2]) for k in LIT_VIEWS]
    views += [(f"extra_{'ab'[k]}", azimuth, 0.5) for k, azimuth in enumerate(NEW_VIEWS)]
    for index, (name, azimuth, height) in enumerate(views):
        _world(0.0)
        sun.hide_render, cloth.hide_render = False, True
        towards = Vector(LAMPS[index % len(LAMPS)]).normalized()
        sun.rotation_euler = towards.to_track_quat("Z", "Y").to_euler()
        place = _ring(azimuth, height)
        _render(folder / "lit" / f"{name}.jpg", place)
        truth["lit"][name] = index % len(LAMPS)
    (folder / ".truth.json").write_text(json.dumps(truth))
    _write_surface(folder / ".surface.npz", thing)


def _ring(azimuth: float, height: float) -> Vector:
    return DISTANCE * Vector((np.cos(azimuth), np.sin(azimuth), height)).normalized()


def _scene() -> tuple[bpy.types.Object, bpy.types.Object]:
    """(the object, the cloth below it)."""
    bpy.ops.wm.read_factory_settings(use_empty=True)
    scene = bpy.context.scene
    scene.render.engine, scene.cycles.samples = "CYCLES", SAMPLES
    scene.cycles.max_bounces = 2
    scene.render.resolution_x, scene.render.resolution_y = WIDTH, HEIGHT
    scene.render.image_settings.file_format = "JPEG"
    scene.render.image_settings.quality = 95
    scene.view_settings.view_transform = "Standard"
    scene.world = bpy.data.worlds.new("world")
    bpy.ops.mesh.primitive_monkey_add(size=2)
    thing = bpy.context.object
    thing.modifiers.new("smooth", "SUBSURF").render_levels = 3
    bpy.ops.object.shade_smooth()
    thing.data.materials.append(_speckled("paint", (0.30, 0.13, 0.08), 14.0, 0.35))
    bpy.ops.mesh.primitive_plane_add(size=9, location=(0, 0, -1.05))
    cloth = bpy.context.object
    cloth.data.materials.append(_speckled("cloth", (0.5, 0.5, 0.45), 3.0, 0.9))
    camera = bpy.data.objects.new("camera", bpy.data.cameras.new("camera"))
    camera.data.lens = LENS
    sun = bpy.data.objects.new("lamp", bpy.data.lights.new("lamp", "SUN"))
    sun.data.energy, sun.data.angle = 4.0, 0.0
    for made in (camera, sun):
        scene.collection.objects.link(made)
    scene.camera = camera
    return thing, cloth


def _speckled(
    name: str, colour: tuple[float, float, float], scale: float, contrast: float
) -> bpy.types.Material:
    """A glossy material whose albedo varies by ``contrast`` over patches and specks."""
    material = bpy.data.materials.new(name)
    material.use_nodes = True
    nodes, links = material.node_tree.nodes, material.node_tree.links
    surface = nodes["Principled BSDF"]
    surface.inputs["Roughness"].default_value = 0.4
    noise, ramp = nodes.new("ShaderNodeTexNoise"), nodes.new("ShaderNodeValToRGB")
    place = nodes.new("ShaderNodeTexCoord")
    links.new(place.outputs["Object"], noise.inputs["Vector"])
    noise.inputs["Scale"].default_value = scale
    noise.inputs["Detail"].default_value = 8.0
    for element, position, factor in zip(
        ramp.color_ramp.elements, (0.42, 0.58), (1 - contrast, 1 + contrast), strict=True
    ):
        element.position = position
        element.color = (*(min(c * factor, 1.0) for c in colour), 1.0)
    links.new(noise.outputs["Fac"], ramp.inputs["Fac"])
    links.new(ramp.outputs["Color"], surface.inputs["Base Color"])
    return material


def _world(strength: float) -> None:
    world = bpy.context.scene.world
    world.use_nodes = True
    background = world.node_tree.nodes["Background"]
    background.inputs["Color"].default_value = (1, 1, 1, 1)
    background.inputs["Strength"].default_value = strength


def _render(path: Path, place: Vector) -> None:
    """Look from a place at the origin and render."""
    camera = bpy.context.scene.camera
    turn = (-place).to_track_quat("-Z", "Y").to_matrix().to_4x4()
    camera.matrix_world = Matrix.Translation(place) @ turn
    bpy.context.scene.render.filepath = str(path)
    bpy.ops.render.render(write_still=True)


def _write_surface(path: Path, thing: bpy.types.Object) -> None:
    """The rendered surface with the normal errors of stereo."""
    from .package import load_patina

    load_patina()
    from patina.core.scan import Mesh

    from .experiments.mesh_error import bumpy

    thing.modifiers["smooth"].levels = 3
    evaluated = thing.evaluated_get(bpy.context.evaluated_depsgraph_get())
    mesh = evaluated.to_mesh()
    mesh.calc_loop_triangles()
    vertices = np.array([v.co for v in mesh.vertices], np.float64)
    faces = np.array([t.vertices for t in mesh.loop_triangles], np.int32)
    scanned = bumpy(Mesh(vertices, faces), MESH_ERROR)
    np.savez(path, vertices=scanned.vertices, faces=scanned.faces)


if __name__ == "__main__":
    main()
