"""The beam profile of a flash as a lamp's node tree, for Cycles (EEVEE ignores it)."""

from __future__ import annotations

import bpy

# the lamp's −Z axis in world space, from its rotation as a quaternion (w, x, y, z)
AXIS = ("-2*(x*z + w*y)", "-2*(y*z - w*x)", "2*(x*x + y*y) - 1")


def add_beam_nodes(lamp: bpy.types.Object, beam: float) -> None:
    """Scale the strength of a point lamp by 2^−(ϑ/beam)² at the angle ϑ from its −Z axis.

    beam: radians; see core/light/near.py. Cycles evaluates the factor exactly at every sample. The
    axis comes from drivers, because a Vector Transform node has no effect in lamps of Blender 4.3,
    and the normal of a lamp with a size is that of its surface.
    """
    data = lamp.data
    data.use_nodes = True
    tree = data.node_tree
    tree.nodes.clear()
    geometry = tree.nodes.new("ShaderNodeNewGeometry")
    along = tree.nodes.new("ShaderNodeVectorMath")
    along.operation = "DOT_PRODUCT"
    # at a lamp, Incoming runs from it to the surface that it lights
    tree.links.new(geometry.outputs["Incoming"], along.inputs[0])
    for part, expression in enumerate(AXIS):
        _drive(along.inputs[1], part, lamp, expression)
    cosine = along.outputs["Value"]
    angle = _math_node(tree, "ARCCOSINE", cosine)
    share = _math_node(tree, "DIVIDE", angle, beam)
    square = _math_node(tree, "MULTIPLY", share, share)
    minus = _math_node(tree, "MULTIPLY", square, -1.0)
    gain = _math_node(tree, "POWER", 2.0, minus)
    emission = tree.nodes.new("ShaderNodeEmission")
    tree.links.new(gain, emission.inputs["Strength"])
    output = tree.nodes.new("ShaderNodeOutputLight")
    tree.links.new(emission.outputs[0], output.inputs["Surface"])
    for index, node in enumerate(tree.nodes):
        node.location = (180.0 * index, 0.0)


def _drive(
    socket: bpy.types.NodeSocket, part: int, lamp: bpy.types.Object, expression: str
) -> None:
    """Drive one component of a vector socket by the lamp's rotation in world space. An expression
    this simple needs no permission to run scripts."""
    driver = socket.driver_add("default_value", part).driver
    driver.type = "SCRIPTED"
    for name in "wxyz":
        variable = driver.variables.new()
        variable.name, variable.type = name, "TRANSFORMS"
        target = variable.targets[0]
        target.id, target.rotation_mode = lamp, "QUATERNION"
        target.transform_type, target.transform_space = f"ROT_{name.upper()}", "WORLD_SPACE"
    driver.expression = expression


def _math_node(
    tree: bpy.types.NodeTree,
    operation: str,
    *operands: bpy.types.NodeSocket | float,
) -> bpy.types.NodeSocket:
    """The output of a new math node; operands are sockets or numbers."""
    node = tree.nodes.new("ShaderNodeMath")
    node.operation = operation
    for socket, operand in zip(node.inputs, operands, strict=False):
        if isinstance(operand, float):
            socket.default_value = operand
        else:
            tree.links.new(operand, socket)
    return node.outputs[0]
