"""What of a material's nodes a moved trait changes: written anew, and put back as it was.

A material whose traits are moved keeps what it had when they were not, to be put back to the bit,
also where the artist had turned an input by hand.
"""

from __future__ import annotations

import json
import logging
from collections.abc import Container, Iterator
from pathlib import Path
from typing import Any

import bpy
import numpy as np
from numpy.typing import NDArray

from ...core.appearance import osl_source
from ...core.appearance.osl_atlas import is_own_name
from ...core.basis import PrincipalBRDF
from ..property_keys import AS_MEASURED, LOBE_GROUP_LAYOUT
from . import osl_files
from .lobe_group import NAME as LOBE_STACK

log = logging.getLogger(__name__)

BODY, BODY_SCALE = "body", "body_scale"  # inputs of the OSL shader, linked where there are maps

WRITTEN = (osl_source.SAMPLING, osl_source.ALPHAS, BODY)  # of the OSL shader, by set_sampling


def principled_node(material: bpy.types.Material) -> bpy.types.Node | None:
    """What exporters see, where it still is the Principled."""
    outputs = (n for n in _nodes(material, "OUTPUT_MATERIAL") if n.target == "ALL")
    links = [link for node in outputs for link in node.inputs["Surface"].links]
    found = (link.from_node for link in links)
    return next((node for node in found if node.type == "BSDF_PRINCIPLED"), None)


def lobe_node(material: bpy.types.Material) -> bpy.types.Node | None:
    """What EEVEE shows."""
    return next(
        (
            node
            for node in _nodes(material, "GROUP")
            if node.node_tree is not None
            and LOBE_GROUP_LAYOUT in node.node_tree
            and node.node_tree.name.split(".")[0] == LOBE_STACK
        ),
        None,
    )


def set_coefficients(material: bpy.types.Material, brdf: PrincipalBRDF) -> int:
    """The shader's inputs; returns how many changed. Every write makes Cycles build it anew."""
    changed = 0
    for node in osl_files.script_nodes(material):
        sockets = {socket.identifier: socket for socket in node.inputs}
        for i, rgb in enumerate(np.asarray(brdf.coefficients).T):
            socket = sockets.get(osl_source.coefficient_name(i))
            if socket is None:
                break
            value = tuple(float(v) for v in np.float32(rgb))
            if tuple(socket.default_value) != value:
                socket.default_value, changed = value, changed + 1
    return changed


def set_sampling(
    material: bpy.types.Material,
    path: Path,
    alphas: tuple[float, float, float],
    body: NDArray[np.floating],
) -> None:
    """The table that half vectors are drawn from, the lobes' widths, and the body's level (3,) for
    those of the shaders that wear maps."""
    for node in osl_files.script_nodes(material):
        sockets = {socket.identifier: socket for socket in node.inputs}
        sockets[osl_source.SAMPLING].default_value = path.resolve().as_posix()
        sockets[osl_source.ALPHAS].default_value = alphas
        if sockets[BODY_SCALE].is_linked:
            sockets[BODY].default_value = tuple(float(v) for v in body)
    material[osl_files.PROPERTIES[osl_source.SAMPLING]] = path.name


def keep(material: bpy.types.Material) -> None:
    """Remember what there is, unless something is remembered already."""
    if AS_MEASURED in material:
        return
    principled, lobes = principled_node(material), lobe_node(material)
    told: dict[str, Any] = {
        "solid": [list(material.diffuse_color), material.metallic, material.roughness],
        "principled": None if principled is None else _inputs(principled),
        "lobes": None if lobes is None else _inputs(lobes),
        "shaders": [_inputs(node, WRITTEN) for node in osl_files.script_nodes(material)],
    }
    material[AS_MEASURED] = json.dumps(told)
    name = material.get(osl_files.PROPERTIES[osl_source.SAMPLING])
    if name:
        material[osl_files.MEASURED_SAMPLING_FILE] = name


def put_back(material: bpy.types.Material) -> None:
    """As it was before any trait was moved; the nodes that are gone stay gone."""
    if AS_MEASURED not in material:
        return
    try:  # the .blend may come from anybody
        _put_all(material, json.loads(material[AS_MEASURED]))
    except (ValueError, TypeError, KeyError, AttributeError, RecursionError) as error:
        log.warning(
            "%s: the property %s is damaged (%s), its values are put back in part; fit the "
            "material again if it looks wrong",
            material.name, AS_MEASURED, error,
        )  # fmt: skip
    name = material.get(osl_files.MEASURED_SAMPLING_FILE)
    if is_own_name(name):
        material[osl_files.PROPERTIES[osl_source.SAMPLING]] = name
        for node in osl_files.script_nodes(material):
            for socket in osl_files.file_sockets(node):
                if socket.identifier == osl_source.SAMPLING:
                    osl_files.read_again(socket, name)
    material.pop(osl_files.MEASURED_SAMPLING_FILE, None)
    del material[AS_MEASURED]


def _put_all(material: bpy.types.Material, told: dict[str, Any]) -> None:
    """Raises ValueError, TypeError, KeyError or AttributeError where ``told`` is not what ``keep``
    writes."""
    color, material.metallic, material.roughness = told["solid"]
    material.diffuse_color = color
    for node, inputs in (
        (principled_node(material), told["principled"]),
        (lobe_node(material), told["lobes"]),
        *zip(osl_files.script_nodes(material), told["shaders"], strict=False),
    ):
        if node is not None and inputs is not None:
            _put_inputs(node, inputs)


def _nodes(material: bpy.types.Material, kind: str) -> Iterator[bpy.types.Node]:
    tree = material.node_tree
    yield from (node for node in (tree.nodes if tree else ()) if node.type == kind)


def _inputs(node: bpy.types.Node, only: Container[str] | None = None) -> dict[str, Any]:
    """Label and inputs (only some of them); floats as JSON has them come back to the bit."""
    values = {
        socket.identifier: _plain(socket.default_value)
        for socket in node.inputs
        if hasattr(socket, "default_value") and (only is None or socket.identifier in only)
    }
    return {"label": node.label, "values": values}


def _plain(value: Any) -> Any:
    return value if isinstance(value, (str, int, float)) else list(value)


def _put_inputs(node: bpy.types.Node, told: dict[str, Any]) -> None:
    node.label = told["label"]
    for socket in node.inputs:
        value = told["values"].get(socket.identifier)
        if socket.identifier in osl_files.PROPERTIES and not is_own_name(_file_name(value)):
            continue  # a path of a shader's file that Patina did not write
        if value is not None and _plain(socket.default_value) != value:
            socket.default_value = value


def _file_name(path: object) -> str:
    return str(path).replace("\\", "/").rpartition("/")[2]
