"""The node tree of a glTF scene: meshes and their transforms.

Khronos Group, glTF 2.0 specification (2021), section 3.5 (scenes, nodes, transformations).
"""

from __future__ import annotations

import math
from collections.abc import Iterator
from typing import Any

import numpy as np
from numpy.typing import NDArray

from .gltf_buffers import Gltf

MAX_NODES, MAX_MESH_NODES = 200_000, 20_000


def placed_meshes(document: Gltf) -> Iterator[tuple[Any, NDArray[np.float64]]]:
    """(index of the mesh, 4 × 4 matrix to the scene's frame) of every node with a mesh.

    The scene is the default one, else the first. In a file without scenes, the roots are all nodes
    that are not a child. A node with two parents, or below itself, raises InputError, as the format
    requires.
    """
    nodes = document.member(document.json, "nodes", list, [])
    if len(nodes) > MAX_NODES:
        raise document.error(f"glTF: it has {len(nodes)} nodes; expected at most {MAX_NODES}")
    parent_of: dict[int, int | None] = {}
    world_matrix: dict[int | None, NDArray[np.float64]] = {None: np.eye(4)}
    stack: list[tuple[Any, int | None]] = [(root, None) for root in _roots(document)]
    placed = 0
    while stack:
        index, parent = stack.pop()
        node = document.entry("nodes", index)
        if index in parent_of:
            raise document.error(f"glTF: nodes[{index}] occurs twice in the tree")
        parent_of[index] = parent
        children = document.member(node, "children", list, [])
        stack += [(child, index) for child in reversed(children)]
        if "mesh" in node:
            placed += 1
            if placed > MAX_MESH_NODES:
                raise document.error(f"glTF: its scene holds more than {MAX_MESH_NODES} meshes")
            yield node["mesh"], _world_matrix(document, index, parent_of, world_matrix)


def _world_matrix(
    document: Gltf,
    index: int,
    parent_of: dict[int, int | None],
    world_matrix: dict[int | None, NDArray[np.float64]],
) -> NDArray[np.float64]:
    """The matrix of a node to the scene's frame. Adds the matrices of its ancestors to
    ``world_matrix``."""
    chain: list[int] = []
    at: int | None = index
    while at is not None and at not in world_matrix:
        chain.append(at)
        at = parent_of[at]
    matrix = world_matrix[at]
    for step in reversed(chain):
        matrix = matrix @ _matrix(document, document.entry("nodes", step))
        world_matrix[step] = matrix
    return matrix


def _roots(document: Gltf) -> list:
    scenes = document.member(document.json, "scenes", list, [])
    if scenes:
        scene = document.entry("scenes", document.json.get("scene", 0))
        roots: list = document.member(scene, "nodes", list, [])
    else:
        nodes = document.member(document.json, "nodes", list, [])
        children: set = set()
        for index in range(len(nodes)):
            below = document.member(document.entry("nodes", index), "children", list, [])
            children.update(child for child in below if isinstance(child, int))
        roots = [index for index in range(len(nodes)) if index not in children]
    return roots[::-1]


def _matrix(document: Gltf, node: dict) -> NDArray[np.float64]:
    """A node's own transform: a matrix (column by column), or translation, rotation and scale."""
    if "matrix" in node:
        matrix = _number_array(document, node, "matrix", [0.0] * 16).reshape(4, 4).T
        return matrix
    x, y, z, w = _number_array(document, node, "rotation", [0.0, 0.0, 0.0, 1.0])
    length = math.sqrt(x * x + y * y + z * z + w * w)
    if not 1e-6 < length < 1e6:
        raise document.error("glTF: a rotation is not a valid quaternion")
    x, y, z, w = x / length, y / length, z / length, w / length
    matrix = np.eye(4)
    matrix[:3, :3] = [
        [1 - 2 * (y * y + z * z), 2 * (x * y - z * w), 2 * (x * z + y * w)],
        [2 * (x * y + z * w), 1 - 2 * (x * x + z * z), 2 * (y * z - x * w)],
        [2 * (x * z - y * w), 2 * (y * z + x * w), 1 - 2 * (x * x + y * y)],
    ]
    matrix[:3, :3] *= _number_array(document, node, "scale", [1.0, 1.0, 1.0])
    matrix[:3, 3] = _number_array(document, node, "translation", [0.0, 0.0, 0.0])
    return matrix


def _number_array(
    document: Gltf, node: dict, key: str, default: list[float]
) -> NDArray[np.float64]:
    values = document.member(node, key, list, default)
    valid = len(values) == len(default) and all(
        isinstance(v, (int, float)) and not isinstance(v, bool) and abs(v) < 1e30 for v in values
    )
    if not valid:
        raise document.error(f"glTF: {key!r} does not hold {len(default)} numbers")
    return np.array(values, np.float64)
