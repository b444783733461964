"""A capture whose only material was separated into several by their reflectance."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from ..capture import Capture, MaterialEntry
from ..scan import Scan

SEPARATED = "patina_separated"  # face attribute: index of the material of each face


def can_separate(capture: Capture) -> bool:
    """Whether the capture has one material for the whole mesh: those that masks or faces locate are
    kept as they are."""
    only = capture.materials[0]
    located = only.by_mesh or capture.named_by_masks(only.name)
    return len(capture.materials) == 1 and not located


def separated_names(name: str, count: int) -> tuple[str, ...]:
    """The names of the parts of a material."""
    return tuple(f"{name}_{number + 1}" for number in range(count))


def with_separated(capture: Capture, names: Sequence[str]) -> Capture:
    """The capture with materials of these names, which the faces of ``separated_scan`` locate."""
    materials = tuple(MaterialEntry(name, faces=SEPARATED) for name in names)
    return replace(capture, materials=materials)


def separated_scan(scan: Scan, face_material: NDArray[np.integer]) -> Scan:
    """The scan with the material of each face. face_material: (f,) index."""
    attributes = {**scan.mesh.face_attributes, SEPARATED: face_material.astype(np.int32)}
    return replace(scan, mesh=replace(scan.mesh, face_attributes=attributes))
