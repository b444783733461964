"""The material that shows a finish of tools/objects/finish.py in Cycles."""

from __future__ import annotations

import bpy
import numpy as np

from .finish import Finish


def coated(body: bpy.types.Object, finish: Finish) -> bpy.types.Material:
    """Store the finish as attributes of the mesh; returns the material that shows it."""
    layers = body.data.attributes
    rgba = np.concatenate([finish.colour, np.ones((len(finish.colour), 1))], axis=1)
    layers.new("colour", "FLOAT_COLOR", "POINT").data.foreach_set(
        "color", rgba.astype(np.float32).ravel()
    )
    for name, value in (("metallic", finish.metallic), ("roughness", finish.roughness)):
        layers.new(name, "FLOAT", "POINT").data.foreach_set("value", value.astype(np.float32))
    material = bpy.data.materials.new("finish")
    material.use_nodes = True
    tree = material.node_tree
    shader = next(node for node in tree.nodes if node.type == "BSDF_PRINCIPLED")
    shader.distribution = "GGX"
    for name, output, socket in (
        ("colour", "Color", "Base Color"),
        ("metallic", "Fac", "Metallic"),
        ("roughness", "Fac", "Roughness"),
    ):
        node = tree.nodes.new("ShaderNodeAttribute")
        node.attribute_name = name
        tree.links.new(node.outputs[output], shader.inputs[socket])
    return material
