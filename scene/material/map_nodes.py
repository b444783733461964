"""Image textures on the nodes of a measured material: maps of what varies over the surface.

The portable branches get base colour, roughness and specular level. The OSL branch and the lobe
stack take the factors of the diffuse body, of the specular part and of the roughness.
"""

from __future__ import annotations

from collections.abc import Mapping

import bpy
import numpy as np
from numpy.typing import NDArray

from ...core.appearance import osl_source
from ..property_keys import MAP_KIND
from . import osl_files
from .lobe_group import DIFFUSE_SCALE, ROUGHNESS_SCALE, SPECULAR_SCALE
from .measured_nodes import lobe_node

NORMAL = "Normal"  # input of the OSL shader, of the lobe stack and of the Principled
SCALE = "scale"  # kind of the map with the factor of the diffuse body
FACTORS = {
    SCALE: osl_source.BODY_SCALE,
    "specular_scale": osl_source.SPECULAR_SCALE,
    "roughness_scale": osl_source.ROUGHNESS_SCALE,
}
"""Kind of map → input of the OSL shader."""
LOBE_FACTORS = {
    SCALE: DIFFUSE_SCALE,
    "specular_scale": SPECULAR_SCALE,
    "roughness_scale": ROUGHNESS_SCALE,
}
"""Kind of map → input of the lobe stack."""
SOCKETS = {
    "base_color": "Base Color",
    "roughness": "Roughness",
    "metallic": "Metallic",
    "specular": "Specular IOR Level",
    "specular_tint": "Specular Tint",
}
"""Kind of map → input of the Principled BSDF."""
STEP = 300  # distance of two image nodes


def assign_maps(
    material: bpy.types.Material,
    images: Mapping[str, bpy.types.Image],
    body: NDArray[np.floating],
    whole: bool,
    uv_layer: str,
) -> None:
    """Link maps to the nodes of a material, in place of earlier ones.

    images: kind → image, the kinds of SOCKETS and FACTORS and "normal". body: (3,) level of the
    diffuse body, 1/sr; whole: True for a material without one, that is scaled as a whole."""
    tree = material.node_tree
    for node in [n for n in tree.nodes if MAP_KIND in n]:
        tree.nodes.remove(node)
    place = tree.nodes.new("ShaderNodeUVMap")
    place.uv_map, place.location, place[MAP_KIND] = uv_layer, (-900, -420), "uv"
    shaders = principled_nodes(material)
    scripts = [n for n in osl_files.script_nodes(material) if _takes_factors(n)]
    lobes = lobe_node(material)
    for script in scripts:
        _socket(script, osl_source.BODY).default_value = tuple(float(v) for v in body)
    for number, (kind, image) in enumerate(images.items()):
        node = _image_node(tree, kind, image, place, (-640, 1020 - STEP * number))
        colour = node.outputs["Color"]
        if kind == "normal":
            turn = tree.nodes.new("ShaderNodeNormalMap")
            turn.uv_map, turn.location, turn[MAP_KIND] = uv_layer, (-320, node.location.y), kind
            tree.links.new(colour, turn.inputs["Color"])
            targets = [*shaders, *osl_files.script_nodes(material), *([lobes] if lobes else ())]
            for shader in targets:
                tree.links.new(turn.outputs["Normal"], shader.inputs[NORMAL])
        if kind in SOCKETS:
            for shader in shaders:
                tree.links.new(colour, shader.inputs[SOCKETS[kind]])
        if kind in FACTORS:
            for script in scripts:
                tree.links.new(colour, _socket(script, FACTORS[kind]))
            name = SPECULAR_SCALE if whole and kind == SCALE else LOBE_FACTORS[kind]
            if lobes is not None and name in lobes.inputs:
                tree.links.new(colour, lobes.inputs[name])
            if whole and kind == SCALE and lobes is not None and DIFFUSE_SCALE in lobes.inputs:
                tree.links.new(colour, lobes.inputs[DIFFUSE_SCALE])


def principled_nodes(material: bpy.types.Material) -> list[bpy.types.Node]:
    """The Principled nodes of a material."""
    return [n for n in material.node_tree.nodes if n.type == "BSDF_PRINCIPLED"]


def _takes_factors(node: bpy.types.Node) -> bool:
    """Whether a shader node has the inputs for maps; those of older files have not."""
    return {osl_source.BODY, *FACTORS.values()} <= {s.identifier for s in node.inputs}


def _socket(node: bpy.types.Node, identifier: str) -> bpy.types.NodeSocket:
    return next(s for s in node.inputs if s.identifier == identifier)


def _image_node(
    tree: bpy.types.NodeTree,
    kind: str,
    image: bpy.types.Image,
    place: bpy.types.Node,
    location: tuple[float, float],
) -> bpy.types.Node:
    node = tree.nodes.new("ShaderNodeTexImage")
    node.image, node.label, node.location = image, kind.replace("_", " "), location
    node[MAP_KIND] = kind
    tree.links.new(place.outputs["UV"], node.inputs["Vector"])
    return node
