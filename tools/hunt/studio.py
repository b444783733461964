"""Renders of the hunt: Cycles path tracing with Patina's OSL material or Blender's closures."""

from __future__ import annotations

import bpy
import numpy as np
from mathutils import Vector

from patina.core.appearance.principled_fit import fit_principled
from patina.core.basis import PrincipalBRDF
from patina.scene.material import material_nodes, osl_files
from patina.scene.material.lamp_inputs import update_lamps

from ..demo_render import Array, Camera, Studio
from ..demo_shape import Surface

BOUNCES = 4  # of light
SAMPLES = 16  # per pixel


class HuntStudio(Studio):
    """One object under a sun or a point lamp."""

    def __init__(self, samples: int = SAMPLES) -> None:
        super().__init__(samples)
        self.scene.cycles.shading_system = True
        self.scene.render.use_persistent_data = True
        self.disc: bpy.types.Object | None = None

    def shape(self, surface: Surface) -> None:
        """Replace the object."""
        self.show(surface, np.zeros(len(surface.points)))

    def measured(self, brdf: PrincipalBRDF) -> bpy.types.Material:
        """Return the BRDF as Patina's OSL material."""
        files = osl_files.ensure_files(brdf)
        fit = fit_principled(brdf.evaluate, coat=False, nodes=(12, 6, 4))
        return material_nodes.create_material("measured", brdf, fit, files)

    def dress_part(self, material: bpy.types.Material, where: Array) -> None:
        """Assign another material to the faces whose vertices are all true in ``where``, (v,)."""
        mesh = self.body.data
        mesh.materials.append(material)
        corner = np.empty(len(mesh.loops), np.int32)
        mesh.loops.foreach_get("vertex_index", corner)
        index = np.all(where[corner.reshape(-1, 3)], axis=1).astype(np.int32)
        mesh.polygons.foreach_set("material_index", index)

    def matte(self, colour: Array) -> bpy.types.Material:
        """Return a Lambertian material."""
        return self._shader("ShaderNodeBsdfDiffuse", {"Color": (*colour, 1.0)})

    def translucent(self, colour: Array, reach: float) -> bpy.types.Material:
        """Return a material with subsurface scattering; reach: scale in scan units."""
        material = self._shader(
            "ShaderNodeSubsurfaceScattering",
            {"Color": (*colour, 1.0), "Scale": reach, "Radius": (1.0, 0.6, 0.4)},
        )
        material.node_tree.nodes["Subsurface Scattering"].falloff = "BURLEY"
        return material

    def brushed(self, roughness: float, anisotropy: float) -> bpy.types.Material:
        """Return a brushed metal, with tangents around the z axis."""
        material = self._shader(
            "ShaderNodeBsdfAnisotropic",
            {"Color": (0.7, 0.65, 0.6, 1.0), "Roughness": roughness, "Anisotropy": anisotropy},
        )
        tree = material.node_tree
        tangent = tree.nodes.new("ShaderNodeTangent")
        tangent.direction_type, tangent.axis = "RADIAL", "Z"
        shader = next(n for n in tree.nodes if n.bl_idname == "ShaderNodeBsdfAnisotropic")
        shader.distribution = "GGX"
        tree.links.new(tangent.outputs[0], shader.inputs["Tangent"])
        return material

    def _shader(self, kind: str, values: dict) -> bpy.types.Material:
        material = bpy.data.materials.new(kind)
        material.use_nodes = True
        tree = material.node_tree
        tree.nodes.clear()
        node = tree.nodes.new(kind)
        for key, value in values.items():
            if key in node.inputs:
                node.inputs[key].default_value = value
        output = tree.nodes.new("ShaderNodeOutputMaterial")
        tree.links.new(node.outputs[0], output.inputs["Surface"])
        return material

    def occluder(self, at: Array, towards: Array, wide: float, high: float) -> None:
        """Place an elliptical disc at ``at``, facing ``towards``, that only casts a shadow."""
        if self.disc is None:
            mesh = bpy.data.meshes.new("occluder")
            turn = np.linspace(0, 2 * np.pi, 48, endpoint=False)
            points = np.stack([np.cos(turn), np.sin(turn), 0 * turn], axis=1)
            mesh.from_pydata(points.tolist(), [], [list(range(len(turn)))])
            self.disc = bpy.data.objects.new("occluder", mesh)
            self.scene.collection.objects.link(self.disc)
            self.disc.visible_camera = False
        self.disc.rotation_mode = "QUATERNION"
        self.disc.rotation_quaternion = Vector(towards).to_track_quat("Z", "Y")
        self.disc.location, self.disc.scale = at, (wide, high, 1.0)

    def room(self, radiance: float) -> None:
        """Set uniform ambient light."""
        self._world(lambda nodes: None, radiance)

    def window(self, direction: Array, radiance: float, width: float) -> None:
        """Set an environment that is black except for a bright spot; width: radians."""

        def spot(nodes: bpy.types.Nodes) -> bpy.types.NodeSocket:
            tree = nodes.id_data
            where = nodes.new("ShaderNodeTexCoord").outputs["Generated"]
            dot = nodes.new("ShaderNodeVectorMath")
            dot.operation = "DOT_PRODUCT"
            dot.inputs[1].default_value = direction
            tree.links.new(where, dot.inputs[0])
            above = nodes.new("ShaderNodeMath")
            above.operation = "GREATER_THAN"
            above.inputs[1].default_value = float(np.cos(width / 2))
            tree.links.new(dot.outputs["Value"], above.inputs[0])
            return above.outputs[0]

        self._world(spot, radiance)

    def _world(self, made, radiance: float) -> None:  # type: ignore[no-untyped-def]
        # a measured material passes a part of the environment light through portals; Cycles treats
        # this part as background, so that a transparent film would remove it
        self.scene.render.film_transparent = False
        tree = self.scene.world.node_tree
        tree.nodes.clear()
        background = tree.nodes.new("ShaderNodeBackground")
        background.inputs["Strength"].default_value = radiance
        output = tree.nodes.new("ShaderNodeOutputWorld")
        tree.links.new(background.outputs[0], output.inputs["Surface"])
        color = made(tree.nodes)
        if color is not None:
            tree.links.new(color, background.inputs["Color"])
        else:
            background.inputs["Color"].default_value = (1, 1, 1, 1)

    def bounce(self, count: int) -> None:
        """Set the largest number of bounces of light."""
        cycles = self.scene.cycles
        cycles.max_bounces = cycles.diffuse_bounces = cycles.glossy_bounces = count
        cycles.transparent_max_bounces = 16

    def noise_free(self, samples: int) -> None:
        """Set the number of samples per pixel, for light that is sampled randomly."""
        self.scene.cycles.samples = samples

    def photo(self, camera: Camera) -> Array:
        """Render (h, w, 3) linear radiance, 0 outside the object."""
        bpy.context.view_layer.update()  # update_lamps reads the evaluated transforms
        update_lamps(self.scene)
        if self.scene.render.film_transparent:
            return self.photograph(camera)[..., :3]
        sky = (1 - self._cover(camera)) * self._sky(camera)
        return self.photograph(camera)[..., :3] - sky

    def _sky(self, camera: Camera) -> Array:
        """Render (h, w, 3) without the object."""
        self.body.hide_render = True
        sky = self.photograph(camera)[..., :3]
        self.body.hide_render = False
        return sky

    def _cover(self, camera: Camera) -> Array:
        """Render (h, w, 1), the fraction of a pixel that shows the object."""
        self.scene.render.film_transparent, layer = True, bpy.context.view_layer
        layer.material_override = self.matte(np.zeros(3))
        cover = self.photograph(camera)[..., 3:]
        bpy.data.materials.remove(layer.material_override)
        self.scene.render.film_transparent = False
        return cover
