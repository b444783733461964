"""The lobe stack as a group of standard nodes, which renders what LobeStack of core computes.

A lobe is a metallic Principled BSDF. Its Fresnel term is Schlick's from the base colour f0/f90 to
white. The tint of a coat that reflects nothing (IOR 1) weights it by f90; Blender applies the tint
over the thickness 1/cosθ, so it is raised to the power cosθ first. The layers below are mixed in by
1 − albedo, with the formula of lobe_stack.albedo_fit as nodes. The nodes work in Cycles and EEVEE.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import bpy
import numpy as np

from ...core.appearance.lobe_stack import ALBEDO_FIT, MAX_LOBES, Lobe, LobeStack
from ..property_keys import LOBE_GROUP_LAYOUT

NAME = "Patina Lobe Stack"
LOBE_NAME = "Patina Lobe"
LAYOUT = 2  # version of the group's nodes
# inputs for maps: factors of the diffuse colours, of the lobes' reflectances, of the lobes' α
DIFFUSE_SCALE, SPECULAR_SCALE, ROUGHNESS_SCALE = (
    "Diffuse Scale", "Specular Scale", "Roughness Scale",
)  # fmt: skip
COLOURS = ("", " Mid", " Edge")  # facing the viewer, midway, at the silhouette


def add_lobe_stack(
    tree: bpy.types.NodeTree, stack: LobeStack, location: tuple[float, float] = (0, 0)
) -> bpy.types.Node:
    """Add a node of the group to ``tree`` with the inputs of ``stack``; its output is 'BSDF'."""
    node = tree.nodes.new("ShaderNodeGroup")
    node.node_tree = stack_group()
    node.width, node.location = 240, location
    fill_lobe_stack(node, stack)
    return node


def fill_lobe_stack(node: bpy.types.Node, stack: LobeStack) -> None:
    """Set the inputs of the group's node; lobes that the stack does not have are black."""
    for name, color in (
        ("", stack.diffuse),
        (" Mid", stack.diffuse_mid),
        (" Edge", stack.diffuse_edge),
    ):
        value = stack.diffuse if color is None else color
        node.inputs[f"Diffuse Color{name}"].default_value = _rgba(value)
    node.inputs["Diffuse Roughness"].default_value = float(stack.diffuse_roughness)
    black = Lobe(np.zeros(3), np.zeros(3), 0.5)
    lobes = (*stack.lobes, *(black for _ in range(MAX_LOBES - len(stack.lobes))))
    for place, lobe in enumerate(lobes, 1):
        for name, color in (("", lobe.f0), (" Mid", lobe.f0_mid), (" Edge", lobe.f0_edge)):
            value = lobe.f0 if color is None else color
            node.inputs[f"Lobe {place} F0{name}"].default_value = _rgba(value)
        node.inputs[f"Lobe {place} F90"].default_value = _rgba(lobe.f90)
        node.inputs[f"Lobe {place} Roughness"].default_value = float(lobe.roughness)


def stack_group() -> bpy.types.NodeTree:
    """The node group of the whole stack, created once per .blend."""
    return _existing(NAME) or _make_stack()


def _existing(name: str) -> bpy.types.NodeTree | None:
    for group in bpy.data.node_groups:
        if group.get(LOBE_GROUP_LAYOUT) == LAYOUT and group.name.split(".")[0] == name:
            return group
    return None


def _new_group(name: str) -> bpy.types.NodeTree:
    group = bpy.data.node_groups.new(name, "ShaderNodeTree")
    group[LOBE_GROUP_LAYOUT] = LAYOUT
    return group


def _make_stack() -> bpy.types.NodeTree:
    group = _new_group(NAME)
    _socket(group, "BSDF", "NodeSocketShader", output=True)
    for name in COLOURS:
        _color(group, f"Diffuse Color{name}", 0.5)
    _fraction(group, "Diffuse Roughness", 0.0)
    for name in (DIFFUSE_SCALE, SPECULAR_SCALE):
        _color(group, name, 1.0)
    _socket(group, ROUGHNESS_SCALE, "NodeSocketFloat").default_value = 1.0
    for place in range(1, MAX_LOBES + 1):
        for name in COLOURS:
            _color(group, f"Lobe {place} F0{name}", 0.0)
        _color(group, f"Lobe {place} F90", 0.0)
        _fraction(group, f"Lobe {place} Roughness", 0.5)
    _normal(group)
    wiring = _Wiring(group)
    normal = wiring.normal()
    paint, shine = wiring.given(DIFFUSE_SCALE), wiring.given(SPECULAR_SCALE)
    wider = wiring.math("SQRT", wiring.given(ROUGHNESS_SCALE))  # roughness is the root of α
    colours = [
        wiring.vector("MULTIPLY", wiring.given(f"Diffuse Color{name}"), paint) for name in COLOURS
    ]
    below = wiring.node(
        "ShaderNodeBsdfDiffuse",
        Color=_blended(wiring, wiring.cosine(normal), colours),
        Roughness=wiring.given("Diffuse Roughness"),
        Normal=normal,
    ).outputs[0]
    for place in range(MAX_LOBES, 0, -1):
        lobe = wiring.node("ShaderNodeGroup", tree=_existing(LOBE_NAME) or _make_lobe())
        for name in ("F0", "F0 Mid", "F0 Edge", "F90"):
            scaled = wiring.vector("MULTIPLY", wiring.given(f"Lobe {place} {name}"), shine)
            wiring.link(scaled, lobe.inputs[name])
        rough = wiring.math("MULTIPLY", wiring.given(f"Lobe {place} Roughness"), wider, clamp=True)
        wiring.link(rough, lobe.inputs["Roughness"])
        wiring.link(normal, lobe.inputs["Normal"])
        wiring.link(below, lobe.inputs["Below"])
        below = lobe.outputs["BSDF"]
    wiring.finish(below)
    return group


def _make_lobe() -> bpy.types.NodeTree:
    group = _new_group(LOBE_NAME)
    _socket(group, "BSDF", "NodeSocketShader", output=True)
    _socket(group, "Below", "NodeSocketShader")
    for name in COLOURS:
        _color(group, f"F0{name}", 0.04)
    _color(group, "F90", 1.0)
    _fraction(group, "Roughness", 0.5)
    _normal(group)
    w = _Wiring(group)
    normal, f90 = w.normal(), w.given("F90")
    cosine = w.cosine(normal)
    f0 = _blended(w, cosine, [w.given(f"F0{name}") for name in COLOURS])
    at_0, at_90 = _albedo(w, cosine, w.math("MULTIPLY", w.given("Roughness"), w.given("Roughness")))
    albedo = w.vector("ADD", w.vector("SCALE", f0, scale=at_0), w.vector("SCALE", f90, scale=at_90))
    red, green, blue = w.node("ShaderNodeSeparateXYZ", Vector=albedo).outputs
    brightest = w.math("MAXIMUM", w.math("MAXIMUM", red, green), blue)
    passed = w.math("SUBTRACT", 1.0, brightest, clamp=True)
    # Mix Shader: the first shader stays unlinked, so the second one is scaled
    below = w.node("ShaderNodeMixShader")
    w.link(passed, below.inputs[0])
    w.link(w.given("Below"), below.inputs[2])
    tint = w.node("ShaderNodeCombineXYZ")
    for channel, part in enumerate(w.node("ShaderNodeSeparateXYZ", Vector=f90).outputs):
        w.link(w.math("POWER", part, cosine), tint.inputs[channel])
    lobe = w.node(
        "ShaderNodeBsdfPrincipled",
        Base_Color=w.vector("DIVIDE", f0, f90),
        Roughness=w.given("Roughness"),
        Normal=normal,
        Coat_Tint=tint.outputs[0],
        Coat_Normal=normal,
    )
    lobe.distribution = "GGX"
    for name, value in (("Metallic", 1.0), ("Coat Weight", 1.0), ("Coat IOR", 1.0),
                        ("Coat Roughness", 1.0)):  # fmt: skip
        lobe.inputs[name].default_value = value
    both = w.node("ShaderNodeAddShader")
    w.link(lobe.outputs[0], both.inputs[0])
    w.link(below.outputs[0], both.inputs[1])
    w.finish(both.outputs[0])
    return group


def _blended(
    w: _Wiring, cosine: bpy.types.NodeSocket, colours: Sequence[bpy.types.NodeSocket]
) -> bpy.types.NodeSocket:
    """lobe_stack.blended as nodes: the colour seen at this cosine of the view."""
    x = w.math("SUBTRACT", 1.0, cosine)
    y = w.math("MULTIPLY", x, x)
    rest = w.math("SUBTRACT", 1.0, y)
    shares = (
        w.math("MULTIPLY", rest, rest),
        w.math("MULTIPLY", w.math("MULTIPLY", 2.0, y), rest),
        w.math("MULTIPLY", y, y),
    )
    a, b, c = (w.vector("SCALE", v, scale=s) for v, s in zip(colours, shares, strict=True))
    return w.vector("ADD", w.vector("ADD", a, b), c)


def _albedo(w: _Wiring, x: bpy.types.NodeSocket, y: bpy.types.NodeSocket) -> tuple:
    """The factors of f0 and f90 in the directional albedo; x: cosθ, y: α."""
    x2, y2 = w.math("MULTIPLY", x, x), w.math("MULTIPLY", y, y)
    terms = [
        x, y, w.math("MULTIPLY", x, y), x2, y2,
        w.math("MULTIPLY", x2, y), w.math("MULTIPLY", x, y2), w.math("MULTIPLY", x2, y2),
    ]  # fmt: skip
    sums: list[bpy.types.NodeSocket | float] = list(ALBEDO_FIT[0])
    for row, term in zip(ALBEDO_FIT[1:], terms, strict=True):
        sums = [w.math("MULTIPLY_ADD", term, c, s) for c, s in zip(row, sums, strict=True)]
    a, b, c, d = sums
    return w.math("DIVIDE", a, c, clamp=True), w.math("DIVIDE", b, d, clamp=True)


@dataclass
class _Wiring:
    """Adds nodes to a group in the order of the calls, from left to right."""

    group: bpy.types.NodeTree
    count: int = 0

    def __post_init__(self) -> None:
        self.entry = self.group.nodes.new("NodeGroupInput")
        self.entry.location = (-300, 0)

    def given(self, name: str) -> bpy.types.NodeSocket:
        return self.entry.outputs[name]

    def link(self, source: bpy.types.NodeSocket, target: bpy.types.NodeSocket) -> None:
        self.group.links.new(source, target)

    def node(
        self, kind: str, tree: bpy.types.NodeTree | None = None, **links: bpy.types.NodeSocket
    ) -> bpy.types.Node:
        """Add a node. links: input → source socket, with _ for a space in the input's name."""
        node = self.group.nodes.new(kind)
        node.location = (40 * self.count, -60 * (self.count % 12))
        self.count += 1
        if tree is not None:
            node.node_tree = tree
        for name, source in links.items():
            self.link(source, node.inputs[name.replace("_", " ")])
        return node

    def math(
        self, operation: str, *values: bpy.types.NodeSocket | float, clamp: bool = False
    ) -> bpy.types.NodeSocket:
        node = self.node("ShaderNodeMath")
        node.operation, node.use_clamp, node.hide = operation, clamp, True
        self._enter(node, values)
        return node.outputs[0]

    def vector(
        self, operation: str, *values: bpy.types.NodeSocket,
        scale: bpy.types.NodeSocket | None = None,
    ) -> bpy.types.NodeSocket:  # fmt: skip
        node = self.node("ShaderNodeVectorMath")
        node.operation, node.hide = operation, True
        self._enter(node, values)
        if scale is not None:
            self.link(scale, node.inputs["Scale"])
        return node.outputs["Value" if operation in ("DOT_PRODUCT", "LENGTH") else "Vector"]

    def normal(self) -> bpy.types.NodeSocket:
        """The input Normal, or the surface normal if nothing is connected (length 0)."""
        given = self.given("Normal")
        absent = self.math("LESS_THAN", self.vector("LENGTH", given), 1e-3)
        own = self.node("ShaderNodeNewGeometry").outputs["Normal"]
        return self.vector("ADD", given, self.vector("SCALE", own, scale=absent))

    def cosine(self, normal: bpy.types.NodeSocket) -> bpy.types.NodeSocket:
        """Cosine between view and normal, at least 1e-4."""
        incoming = self.node("ShaderNodeNewGeometry").outputs["Incoming"]
        cosine = self.vector("DOT_PRODUCT", incoming, normal)
        return self.math("MINIMUM", self.math("MAXIMUM", cosine, 1e-4), 1.0)

    def finish(self, shader: bpy.types.NodeSocket) -> None:
        end = self.node("NodeGroupOutput")
        self.link(shader, end.inputs["BSDF"])

    def _enter(self, node: bpy.types.Node, values: Sequence[bpy.types.NodeSocket | float]) -> None:
        for socket, value in zip(node.inputs, values, strict=False):
            if isinstance(value, bpy.types.NodeSocket):
                self.link(value, socket)
            else:
                socket.default_value = value


def _socket(
    group: bpy.types.NodeTree, name: str, kind: str, output: bool = False
) -> bpy.types.NodeTreeInterfaceSocket:
    return group.interface.new_socket(
        name, in_out="OUTPUT" if output else "INPUT", socket_type=kind
    )


def _color(group: bpy.types.NodeTree, name: str, grey: float) -> None:
    _socket(group, name, "NodeSocketColor").default_value = (grey, grey, grey, 1.0)


def _fraction(group: bpy.types.NodeTree, name: str, value: float) -> None:
    socket = _socket(group, name, "NodeSocketFloat")
    socket.subtype, socket.min_value, socket.max_value = "FACTOR", 0.0, 1.0
    socket.default_value = value


def _normal(group: bpy.types.NodeTree) -> None:
    _socket(group, "Normal", "NodeSocketVector").hide_value = True


def _rgba(color: np.ndarray) -> tuple[float, float, float, float]:
    red, green, blue = (float(c) for c in color)
    return red, green, blue, 1.0
