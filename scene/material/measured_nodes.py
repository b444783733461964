"""Write and restore the node inputs that depend on a material's traits.

A material with edited traits stores its inputs as they were before. Resetting the traits restores
them exactly, including inputs that the user had changed.
"""

from __future__ import annotations

import json
import logging
from collections.abc import Container, Iterator
from pathlib import Path
from typing import Any

import bpy
import numpy as np

from ...core.appearance import osl_source
from ...core.appearance.osl_atlas import is_own_name
from ...core.basis import PrincipalBRDF
from ...core.varying.split import BodySplit
from ..property_keys import AS_MEASURED, LOBE_GROUP_LAYOUT
from . import osl_files
from .lobe_group import NAME as LOBE_STACK

log = logging.getLogger(__name__)

SAMPLING_INPUTS = (
    osl_source.SAMPLING,
    osl_source.ALPHAS,
    osl_source.BODY,
)  # inputs that set_sampling writes


def principled_node(material: bpy.types.Material) -> bpy.types.Node | None:
    """The Principled node that exporters read; None if the user has linked another shader."""
    outputs = (n for n in _nodes(material, "OUTPUT_MATERIAL") if n.target == "ALL")
    links = [link for node in outputs for link in node.inputs["Surface"].links]
    found = (link.from_node for link in links)
    return next((node for node in found if node.type == "BSDF_PRINCIPLED"), None)


def lobe_node(material: bpy.types.Material) -> bpy.types.Node | None:
    """The node of the lobe stack, which EEVEE shows; None if there is none."""
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
    """Write the coefficients into the shader's inputs; returns the number of changed inputs.

    Inputs with equal values are not written: every write makes Cycles compile the shader again.
    """
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
    split: BodySplit,
) -> None:
    """Write the inputs for importance sampling into the shaders.

    path: EXR of the table that half vectors are sampled from; alphas: widths of the GGX lobes;
    split: of the BRDF, for shaders with maps.
    """
    for node in osl_files.script_nodes(material):
        sockets = {socket.identifier: socket for socket in node.inputs}
        sockets[osl_source.SAMPLING].default_value = path.resolve().as_posix()
        sockets[osl_source.ALPHAS].default_value = alphas
        if sockets[osl_source.BODY_SCALE].is_linked:  # there are maps
            both = sockets[osl_source.SPECULAR_SCALE].is_linked
            body = split.level if both else split.body
            sockets[osl_source.BODY].default_value = tuple(float(v) for v in body)
    material[osl_files.PROPERTIES[osl_source.SAMPLING]] = path.name


def store_inputs(material: bpy.types.Material) -> None:
    """Store the inputs as measured on the material, unless they are stored already."""
    if AS_MEASURED in material:
        return
    principled, lobes = principled_node(material), lobe_node(material)
    stored: dict[str, Any] = {
        "solid": [list(material.diffuse_color), material.metallic, material.roughness],
        "principled": None if principled is None else _inputs(principled),
        "lobes": None if lobes is None else _inputs(lobes),
        "shaders": [_inputs(node, SAMPLING_INPUTS) for node in osl_files.script_nodes(material)],
    }
    material[AS_MEASURED] = json.dumps(stored)
    name = material.get(osl_files.PROPERTIES[osl_source.SAMPLING])
    if name:
        material[osl_files.MEASURED_SAMPLING_FILE] = name


def restore_inputs(material: bpy.types.Material) -> None:
    """Restore the inputs as measured. Nodes that were removed are not restored."""
    if AS_MEASURED not in material:
        return
    try:  # the .blend may come from an untrusted source
        _restore_all(material, json.loads(material[AS_MEASURED]))
    except (ValueError, TypeError, KeyError, AttributeError, RecursionError) as error:
        log.warning(
            "%s: the property %s is damaged (%s). Its values were restored only in part; if the "
            "material looks wrong, fit it again.",
            material.name, AS_MEASURED, error,
        )  # fmt: skip
    name = material.get(osl_files.MEASURED_SAMPLING_FILE)
    if is_own_name(name):
        material[osl_files.PROPERTIES[osl_source.SAMPLING]] = name
        for node in osl_files.script_nodes(material):
            for socket in osl_files.file_sockets(node):
                if socket.identifier == osl_source.SAMPLING:
                    osl_files.restore_file(socket, name)
    material.pop(osl_files.MEASURED_SAMPLING_FILE, None)
    del material[AS_MEASURED]


def _restore_all(material: bpy.types.Material, stored: dict[str, Any]) -> None:
    """Restore the stored inputs. Raises ValueError, TypeError, KeyError or AttributeError if
    ``stored`` does not have the format that ``keep`` writes."""
    color, material.metallic, material.roughness = stored["solid"]
    material.diffuse_color = color
    for node, inputs in (
        (principled_node(material), stored["principled"]),
        (lobe_node(material), stored["lobes"]),
        *zip(osl_files.script_nodes(material), stored["shaders"], strict=False),
    ):
        if node is not None and inputs is not None:
            _restore_inputs(node, inputs)


def _nodes(material: bpy.types.Material, kind: str) -> Iterator[bpy.types.Node]:
    tree = material.node_tree
    yield from (node for node in (tree.nodes if tree else ()) if node.type == kind)


def _inputs(node: bpy.types.Node, only: Container[str] | None = None) -> dict[str, Any]:
    """Label and inputs of a node (``only`` these inputs); JSON stores the floats exactly."""
    values = {
        socket.identifier: _plain(socket.default_value)
        for socket in node.inputs
        if hasattr(socket, "default_value") and (only is None or socket.identifier in only)
    }
    return {"label": node.label, "values": values}


def _plain(value: Any) -> Any:
    return value if isinstance(value, (str, int, float)) else list(value)


def _restore_inputs(node: bpy.types.Node, stored: dict[str, Any]) -> None:
    node.label = stored["label"]
    for socket in node.inputs:
        value = stored["values"].get(socket.identifier)
        if socket.identifier in osl_files.PROPERTIES and not is_own_name(_file_name(value)):
            continue  # the path of a shader file that Patina did not write
        if value is not None and _plain(socket.default_value) != value:
            socket.default_value = value


def _file_name(path: object) -> str:
    return str(path).replace("\\", "/").rpartition("/")[2]
