"""MaterialX 1.39 documents of a lobe stack and of an OpenPBR surface, written as plain XML.

Lobe stack: `oren_nayar_diffuse_bsdf` below `generalized_schlick_bsdf` lobes, combined by `layer`;
colours that change towards grazing view are mixed by `facingratio`. OpenPBR:
`open_pbr_surface`. Node definitions: the standard nodes, the physically based shading nodes and
OpenPBR 1.1 of MaterialX 1.39. Writing needs no MaterialX package.
"""

from __future__ import annotations

import xml.etree.ElementTree as ET  # written, never read
from collections.abc import Sequence
from dataclasses import fields
from pathlib import Path
from typing import Any

import numpy as np

from ..appearance.lobe_stack import Lobe, LobeStack
from ..appearance.open_pbr.model import OpenPBR
from ..files import atomic_path

VERSION = "1.39"
COLORSPACE = "lin_rec709"


def document() -> ET.Element:
    """An empty document with linear Rec. 709 colours."""
    return ET.Element("materialx", version=VERSION, colorspace=COLORSPACE)


def add_lobe_stack(root: ET.Element, name: str, stack: LobeStack) -> str:
    """Add the stack as nodes and a surfacematerial of this name (an identifier); returns it."""
    if not stack.plain:
        _add_turning(root, name)
    turned = _turned_color(
        root, name, "diffuse", (stack.diffuse, stack.diffuse_mid, stack.diffuse_edge)
    )
    base = _node(root, "oren_nayar_diffuse_bsdf", f"{name}_diffuse", "BSDF")
    _input(base, "weight", "float", 1.0)
    _color(base, "color", stack.diffuse, turned)
    _input(base, "roughness", "float", stack.diffuse_roughness)
    _input(base, "energy_compensation", "boolean", True)
    below = f"{name}_diffuse"
    for index in reversed(range(len(stack.lobes))):  # the first lobe is the topmost one
        top = _add_lobe(root, name, f"lobe{index + 1}", stack.lobes[index])
        layer = _node(root, "layer", f"{name}_layer{index + 1}", "BSDF")
        _connect(layer, "top", "BSDF", top)
        _connect(layer, "base", "BSDF", below)
        below = f"{name}_layer{index + 1}"
    surface = _node(root, "surface", f"{name}_surface", "surfaceshader")
    _connect(surface, "bsdf", "BSDF", below)
    return _add_material(root, name, f"{name}_surface")


def _add_turning(root: ET.Element, name: str) -> None:
    """Add the node NAME_turned, (1 − cos θo)², the argument of the colour polynomials."""
    facing = _node(root, "facingratio", f"{name}_facing", "float")
    _input(facing, "faceforward", "boolean", True)
    away = _node(root, "subtract", f"{name}_away", "float")
    _input(away, "in1", "float", 1.0)
    _connect(away, "in2", "float", f"{name}_facing")
    turned = _node(root, "multiply", f"{name}_turned", "float")
    _connect(turned, "in1", "float", f"{name}_away")
    _connect(turned, "in2", "float", f"{name}_away")


def _turned_color(
    root: ET.Element, name: str, part: str, values: tuple[Any, Any, Any]
) -> str | None:
    """Add nodes that mix three colours (normal, intermediate and grazing view) by quadratic
    Bernstein polynomials (de Casteljau's algorithm); returns the name of the last node, None for a
    constant colour."""
    facing, mid, edge = values
    if mid is None and edge is None:
        return None
    mid, edge = facing if mid is None else mid, facing if edge is None else edge
    ends = []
    for step, (first, second) in enumerate(((facing, mid), (mid, edge)), 1):
        node = _node(root, "mix", f"{name}_{part}_color{step}", "color3")
        _input(node, "bg", "color3", first)
        _input(node, "fg", "color3", second)
        _connect(node, "mix", "float", f"{name}_turned")
        ends.append(f"{name}_{part}_color{step}")
    whole = _node(root, "mix", f"{name}_{part}_color", "color3")
    _connect(whole, "bg", "color3", ends[0])
    _connect(whole, "fg", "color3", ends[1])
    _connect(whole, "mix", "float", f"{name}_turned")
    return f"{name}_{part}_color"


def _color(node: ET.Element, name: str, value: Any, turned: str | None) -> None:
    """Set a colour input to a value, or connect it to the node ``turned``."""
    if turned is None:
        _input(node, name, "color3", value)
    else:
        _connect(node, name, "color3", turned)


def _add_lobe(root: ET.Element, stack: str, part: str, lobe: Lobe) -> str:
    """Add a specular lobe; returns the name of its node."""
    name = f"{stack}_{part}"
    turned = _turned_color(root, stack, part, (lobe.f0, lobe.f0_mid, lobe.f0_edge))
    node = _node(root, "generalized_schlick_bsdf", name, "BSDF")
    alpha = float(lobe.roughness) ** 2
    _input(node, "weight", "float", 1.0)
    _color(node, "color0", lobe.f0, turned)
    _input(node, "color90", "color3", lobe.f90)
    _input(node, "exponent", "float", lobe.exponent)
    _input(node, "roughness", "vector2", (alpha, alpha))
    _input(node, "distribution", "string", "ggx")
    _input(node, "scatter_mode", "string", "R")
    return name


def add_open_pbr(root: ET.Element, name: str, surface: OpenPBR) -> str:
    """Add an OpenPBR surface and a surfacematerial of this name; returns the name."""
    node = _node(root, "open_pbr_surface", f"{name}_surface", "surfaceshader")
    for field in fields(surface):
        value = getattr(surface, field.name)
        _input(node, field.name, "color3" if np.ndim(value) else "float", value)
    return _add_material(root, name, f"{name}_surface")


def write(path: Path, root: ET.Element) -> None:
    """Write the document atomically: a failed write leaves no partial file."""
    ET.indent(root, "  ")
    with atomic_path(path) as partial:
        ET.ElementTree(root).write(partial, encoding="utf-8", xml_declaration=True)


def _add_material(root: ET.Element, name: str, surface: str) -> str:
    material = _node(root, "surfacematerial", name, "material")
    _connect(material, "surfaceshader", "surfaceshader", surface)
    return name


def _node(root: ET.Element, kind: str, name: str, type_: str) -> ET.Element:
    return ET.SubElement(root, kind, name=name, type=type_)


def _input(node: ET.Element, name: str, type_: str, value: Any) -> None:
    ET.SubElement(node, "input", name=name, type=type_, value=_text(value))


def _connect(node: ET.Element, name: str, type_: str, other: str) -> None:
    ET.SubElement(node, "input", name=name, type=type_, nodename=other)


def _text(value: Any) -> str:
    if isinstance(value, bool):
        return "true" if value else "false"
    if isinstance(value, str):
        return value
    if isinstance(value, (Sequence, np.ndarray)):
        return ", ".join(_text(float(v)) for v in value)
    return f"{float(value):.9g}"
