"""Renders of the demo capture: Cycles with one lamp, direct light and cast shadows only."""

from __future__ import annotations

import tempfile
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import bpy
import numpy as np
import OpenImageIO as oiio
from mathutils import Matrix, Vector
from mathutils.bvhtree import BVHTree
from numpy.typing import NDArray

from .demo_shape import Array, Surface, vertex_normals

GLAZE = {
    "Base Color": (0.007, 0.140, 0.165),
    "Roughness": 0.25,
    "IOR": 1.5,
    "Diffuse Roughness": 0.0,
    "Specular IOR Level": 0.5,
}
CLAY = {
    "Base Color": (0.46, 0.205, 0.098),
    "Roughness": 0.80,
    "IOR": 1.5,
    "Diffuse Roughness": 0.6,
    "Specular IOR Level": 0.25,
}
"""The two materials: inputs of Blender's Principled BSDF (GGX), others at their defaults."""


@dataclass(frozen=True)
class Camera:
    """A pinhole camera as in COLMAP: x right, y down, z forward, pixel centres at +0.5.

    `rotation` (3, 3) and `translation` (3,) take the scan's frame to the camera's; `focal` and
    `centre` (2,) are in pixels, `size` is (width, height).
    """

    rotation: Array
    translation: Array
    focal: float
    centre: tuple[float, float]
    size: tuple[int, int]

    @property
    def position(self) -> Array:
        """The centre of projection in the frame of the scan."""
        return -self.rotation.T @ self.translation

    @property
    def to_world(self) -> Array:
        """(4, 4) from Blender's camera (x right, y up, view along −z) to the frame of the scan."""
        pose = np.eye(4)
        pose[:3, :3] = self.rotation.T @ np.diag([1.0, -1.0, -1.0])
        pose[:3, 3] = self.position
        return pose

    def project(self, points: Array) -> Array:
        """Return pixel coordinates (n, 2) of points (n, 3)."""
        in_camera = points @ self.rotation.T + self.translation
        return self.focal * in_camera[:, :2] / in_camera[:, 2:] + np.array(self.centre)


def decimated(surface: Surface, faces: int) -> Surface:
    """Return a mesh with about that many triangles, smaller at high curvature (Decimate)."""
    mesh = bpy.data.meshes.new("decimated")
    mesh.from_pydata(surface.points.tolist(), [], surface.triangles.tolist())
    thing = bpy.data.objects.new("decimated", mesh)
    bpy.context.scene.collection.objects.link(thing)
    modifier = thing.modifiers.new("collapse", "DECIMATE")
    modifier.ratio = faces / len(surface.triangles)
    result = thing.evaluated_get(bpy.context.evaluated_depsgraph_get()).to_mesh()
    points = np.empty((len(result.vertices), 3), np.float32)
    triangles = np.empty((len(result.polygons), 3), np.int32)
    result.vertices.foreach_get("co", points.ravel())
    result.polygons.foreach_get("vertices", triangles.ravel())
    bpy.data.objects.remove(thing)
    exact, whole = points.astype(np.float64), triangles.astype(np.int64)
    return Surface(exact, whole, vertex_normals(exact, whole))


class Occluder:
    """A mesh for ray casts."""

    def __init__(self, surface: Surface) -> None:
        self.tree = BVHTree.FromPolygons(surface.points.tolist(), surface.triangles.tolist())

    def free(self, start: Array, direction: Array) -> bool:
        """Return whether a ray hits nothing."""
        return self.tree.ray_cast(Vector(start), Vector(direction))[0] is None


class Studio:
    """A Cycles scene with one object, to render photos of it."""

    def __init__(self, samples: int = 128) -> None:
        bpy.ops.wm.read_factory_settings(use_empty=True)
        self.scene = scene = bpy.context.scene
        scene.render.engine = "CYCLES"
        scene.world = bpy.data.worlds.new("black")
        scene.world.use_nodes = True
        scene.world.node_tree.nodes.clear()
        cycles = scene.cycles
        cycles.device, cycles.seed, cycles.samples = "CPU", 0, samples
        cycles.use_adaptive_sampling = cycles.use_denoising = False
        cycles.pixel_filter_type = "BOX"
        cycles.max_bounces = cycles.diffuse_bounces = cycles.glossy_bounces = 0
        cycles.sample_clamp_direct = cycles.blur_glossy = cycles.light_sampling_threshold = 0.0
        scene.render.film_transparent = True
        image = scene.render.image_settings
        image.file_format, image.color_mode, image.color_depth = "OPEN_EXR", "RGBA", "32"
        lamp = bpy.data.lights.new("lamp", "SUN")
        lamp.angle = 0.0
        lens = bpy.data.cameras.new("lens")
        lens.clip_start = 0.01
        self.lamp = bpy.data.objects.new("lamp", lamp)
        self.lens = bpy.data.objects.new("lens", lens)
        for thing in (self.lamp, self.lens):
            scene.collection.objects.link(thing)
        scene.camera = self.lens
        self.body: bpy.types.Object | None = None
        self.point: bpy.types.Object | None = None

    def show(self, surface: Surface, glazed: Array) -> None:
        """Replace the object by a mesh; `glazed` (v,) is per point."""
        if self.body is not None:
            bpy.data.objects.remove(self.body)
        mesh = bpy.data.meshes.new("body")
        mesh.from_pydata(surface.points.tolist(), [], surface.triangles.tolist())
        mesh.shade_smooth()
        mesh.normals_split_custom_set_from_vertices(surface.normals.tolist())
        layer = mesh.attributes.new("glazed", "FLOAT", "POINT")
        layer.data.foreach_set("value", glazed.astype(np.float32))
        self.body = bpy.data.objects.new("body", mesh)
        self.scene.collection.objects.link(self.body)

    def dress(self, material: bpy.types.Material) -> None:
        """Assign a material to the object."""
        self.body.data.materials.clear()
        self.body.data.materials.append(material)

    def light(self, direction: Array, irradiance: float) -> None:
        """Set the direction (surface → light) and irradiance of the sun."""
        self.lamp.data.energy = irradiance
        self.lamp.rotation_mode = "QUATERNION"
        self.lamp.rotation_quaternion = Vector(direction).to_track_quat("Z", "Y")

    def near(self, position: Array, irradiance: float, centre: Array) -> None:
        """Use a point lamp at ``position``, as bright at ``centre`` as a sun of this irradiance."""
        if self.point is None:
            lamp = bpy.data.lights.new("near", "POINT")
            lamp.shadow_soft_size = 0.0
            self.point = bpy.data.objects.new("near", lamp)
            self.scene.collection.objects.link(self.point)
        distance = float(np.linalg.norm(position - centre))
        # Blender's watts of a point lamp: intensity W / (4π · π) per sr and unit of radiance
        self.point.data.energy = 4 * np.pi**2 * irradiance / np.pi * distance**2
        self.point.location = position
        self.lamp.hide_render = True

    def photograph(self, camera: Camera) -> Array:
        """Render linear RGBA (height, width, 4), row 0 on top; alpha: coverage by the object."""
        width, height = camera.size
        lens, render = self.lens.data, self.scene.render
        lens.sensor_fit, lens.sensor_width = "HORIZONTAL", 36.0
        lens.lens = camera.focal * lens.sensor_width / width
        lens.shift_x = (width / 2 - camera.centre[0]) / width
        lens.shift_y = (camera.centre[1] - height / 2) / width
        self.lens.matrix_world = Matrix(camera.to_world.tolist())
        render.resolution_x, render.resolution_y, render.resolution_percentage = width, height, 100
        with tempfile.TemporaryDirectory() as folder:
            render.filepath = str(Path(folder) / "photo.exr")
            bpy.ops.render.render(write_still=True)
            pixels = oiio.ImageBuf(render.filepath).get_pixels(oiio.FLOAT)
            return np.asarray(pixels, dtype=np.float64)


def _threshold(tree: bpy.types.NodeTree) -> bpy.types.NodeSocket:
    """Return a socket that is 1 on the glaze and 0 on the clay."""
    attribute = tree.nodes.new("ShaderNodeAttribute")
    attribute.attribute_name = "glazed"
    step = tree.nodes.new("ShaderNodeMath")
    step.operation = "GREATER_THAN"
    step.inputs[1].default_value = 0.0
    tree.links.new(attribute.outputs["Fac"], step.inputs[0])
    return step.outputs[0]


def _split(name: str, shaders: Sequence[tuple[str, dict]]) -> bpy.types.Material:
    """Return a material with the first shader on the clay and the second on the glaze."""
    material = bpy.data.materials.new(name)
    material.use_nodes = True
    tree = material.node_tree
    tree.nodes.clear()
    mix = tree.nodes.new("ShaderNodeMixShader")
    tree.links.new(_threshold(tree), mix.inputs[0])
    for slot, (kind, values) in enumerate(shaders, start=1):
        node = tree.nodes.new(kind)
        for key, value in values.items():
            node.inputs[key].default_value = (*value, 1.0) if isinstance(value, tuple) else value
        if kind == "ShaderNodeBsdfPrincipled":
            node.distribution = "GGX"
        tree.links.new(node.outputs[0], mix.inputs[slot])
    output = tree.nodes.new("ShaderNodeOutputMaterial")
    tree.links.new(mix.outputs[0], output.inputs["Surface"])
    return material


def pottery() -> bpy.types.Material:
    """Return the material of the lit photos."""
    kind = "ShaderNodeBsdfPrincipled"
    return _split("pottery", ((kind, CLAY), (kind, GLAZE)))


def identity() -> bpy.types.Material:
    """Return a material with the coverage by glaze in red and by clay in green."""
    kind = "ShaderNodeEmission"
    return _split("identity", ((kind, {"Color": (0.0, 1.0, 0.0)}), (kind, {"Color": (1.0, 0, 0)})))


def lambertian() -> bpy.types.Material:
    """Return a white Lambertian material, for the check of the irradiance."""
    white = ("ShaderNodeBsdfDiffuse", {"Color": (1.0, 1.0, 1.0), "Roughness": 0.0})
    return _split("white", (white, white))


def plane(centre: Array, normal: Array, size: float = 4.0) -> Surface:
    """Return a square around `centre` that faces `normal`."""
    across = np.linalg.svd(normal[None])[2][1:]
    across[1] *= np.sign(np.linalg.det(np.stack([*across, normal])))
    corners = np.array([[-1, -1], [1, -1], [1, 1], [-1, 1]]) @ across * size / 2 + centre
    triangles: NDArray[np.int64] = np.array([[0, 1, 2], [0, 2, 3]])
    return Surface(corners, triangles, np.tile(normal, (4, 1)))
