"""A unit sphere in Cycles, seen by an orthographic camera from +z, with the normal of every pixel
known.
"""

from __future__ import annotations

from pathlib import Path

import bpy
import numpy as np

from patina.core.appearance.layered_model import Configuration

HALF_WIDTH = 1.05  # half width of the image, in radii


def new_scene(size: int = 64, samples: int = 1, osl: bool = False) -> bpy.types.Object:
    """Empty the .blend and put the sphere in it; returns the sphere."""
    bpy.ops.wm.read_factory_settings(use_empty=True)
    scene = bpy.context.scene
    scene.render.engine = "CYCLES"
    cycles = scene.cycles
    cycles.device, cycles.samples, cycles.use_denoising = "CPU", samples, False
    cycles.use_adaptive_sampling, cycles.light_sampling_threshold = False, 0.0
    # a filter without width: with one sample, the ray goes through the pixel's centre
    cycles.pixel_filter_type, cycles.filter_width = "BOX", 0.01
    cycles.shading_system = osl
    scene.render.resolution_x = scene.render.resolution_y = size
    scene.render.resolution_percentage = 100
    scene.render.use_persistent_data = False
    scene.world = bpy.data.worlds.new("black")
    sky(0.0)
    camera = bpy.data.objects.new("camera", bpy.data.cameras.new("camera"))
    camera.data.type, camera.data.ortho_scale = "ORTHO", 2 * HALF_WIDTH
    camera.location = (0, 0, 5)
    scene.collection.objects.link(camera)
    scene.camera = camera
    sphere = bpy.data.objects.new("sphere", _sphere_mesh(512, 256))
    scene.collection.objects.link(sphere)
    bpy.context.view_layer.update()
    return sphere


def _sphere_mesh(segments: int, rings: int) -> bpy.types.Mesh:
    """Smooth unit sphere with its poles on the y axis, where the camera does not see them."""
    u = np.arange(segments) / segments * 2 * np.pi
    v = np.linspace(0, np.pi, rings + 1)
    around, down = np.meshgrid(u, v)
    points = np.stack(
        [np.sin(down) * np.sin(around), np.cos(down), np.sin(down) * np.cos(around)], axis=-1
    )
    column, row = np.meshgrid(np.arange(segments), np.arange(rings))
    after = (column + 1) % segments
    corners = [row * segments + column, (row + 1) * segments + column,
               (row + 1) * segments + after, row * segments + after]  # fmt: skip
    faces = np.stack(corners, axis=-1).reshape(-1, 4)
    # the poles' quads have an edge of length 0: smooth normals are still right
    mesh = bpy.data.meshes.new("sphere")
    mesh.from_pydata(points.reshape(-1, 3).tolist(), [], faces.tolist())
    mesh.shade_smooth()
    return mesh


def sky(strength: float) -> None:
    """Uniform radiance from all directions."""
    world = bpy.context.scene.world
    world.use_nodes = True
    nodes = world.node_tree.nodes
    background = next((n for n in nodes if n.type == "BACKGROUND"), None)
    if background is None:
        background = nodes.new("ShaderNodeBackground")
        output = nodes.new("ShaderNodeOutputWorld")
        world.node_tree.links.new(background.outputs[0], output.inputs[0])
    background.inputs["Color"].default_value = (1, 1, 1, 1)
    background.inputs["Strength"].default_value = strength


def sun(direction: np.ndarray, irradiance: float = 1.0) -> bpy.types.Object:
    """A sun without angular size; direction: surface → light."""
    from mathutils import Vector

    lamp = bpy.data.lights.new("sun", "SUN")
    lamp.energy, lamp.angle = irradiance, 0.0
    lamp_object = bpy.data.objects.new("sun", lamp)
    lamp_object.rotation_mode = "QUATERNION"
    lamp_object.rotation_quaternion = Vector(direction).to_track_quat("Z", "Y")
    bpy.context.scene.collection.objects.link(lamp_object)
    return lamp_object


def normals() -> tuple[np.ndarray, np.ndarray]:
    """(normal (h, w, 3), inside (h, w)) of every pixel's centre, row 0 on top."""
    size = bpy.context.scene.render.resolution_x
    u = ((np.arange(size) + 0.5) / size * 2 - 1) * HALF_WIDTH
    x, y = np.meshgrid(u, -u)
    r2 = x * x + y * y
    z = np.sqrt(np.maximum(1 - r2, 0))
    return np.stack([x, y, z], axis=-1), r2 < 0.995


def diffuse(albedo: float) -> bpy.types.Material:
    """Cycles' own Lambertian."""
    material = bpy.data.materials.new("diffuse")
    material.use_nodes = True
    tree = material.node_tree
    tree.nodes.clear()
    node = tree.nodes.new("ShaderNodeBsdfDiffuse")
    node.inputs["Color"].default_value = (albedo, albedo, albedo, 1)
    output = tree.nodes.new("ShaderNodeOutputMaterial")
    tree.links.new(node.outputs["BSDF"], output.inputs["Surface"])
    return material


def assert_matches_model(image: np.ndarray, model, light: np.ndarray, irradiance: float) -> None:
    """Check that a rendering under one sun matches a layered model, up to the sphere's tessellation
    error, which grows with the lobe's sharpness.
    """
    normal, inside = normals()
    view = np.array([0.0, 0.0, 1.0])
    half = (light + view) / np.linalg.norm(light + view)
    where = Configuration(
        normal @ light, normal @ view, normal @ half, np.full(inside.shape, light @ half)
    )
    expected = irradiance * model.at(where) * np.maximum(where.cos_i, 0)[..., None]
    kept = inside & (where.cos_i > 0.1) & (where.cos_o > 0.1)
    error = np.abs(image[kept] - expected[kept])
    assert np.sqrt(np.sum(error**2) / np.sum(expected[kept] ** 2)) < 0.005
    assert (error / np.maximum(expected[kept], 1e-3)).max() < 0.015


def render(folder: Path) -> np.ndarray:
    """(h, w, 3) linear radiance, row 0 on top."""
    import OpenImageIO as oiio

    scene = bpy.context.scene
    settings = scene.render.image_settings
    if hasattr(settings, "media_type"):
        settings.media_type = "IMAGE"
    settings.file_format, settings.color_depth = "OPEN_EXR", "32"
    settings.color_mode = "RGB"
    scene.render.filepath = str(folder / "render.exr")
    bpy.ops.render.render(write_still=True)
    return np.array(oiio.ImageBuf(scene.render.filepath).get_pixels(oiio.FLOAT))[..., :3]
