"""Which pixels of a photo belong to which material, by faces of the mesh and masks."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np
from numpy.typing import NDArray

from ..capture import Capture, MaterialEntry
from ..capture.model import EXCLUDED_MASKS
from ..geometry import SurfaceView
from ..scan import Scan

PAINTED = "patina_painted"  # face attribute: index of the material painted on the mesh, −1 none


def face_attribute(material: MaterialEntry) -> str | None:
    """The face attribute that locates a material on the mesh, None for a material by masks."""
    if material.vertex_colour is not None or material.texture_colour is not None:
        return PAINTED
    return material.faces


def material_pixels(
    capture: Capture,
    scan: Scan,
    view: SurfaceView,
    photo_masks: Mapping[str, NDArray[np.bool_]],
) -> tuple[dict[str, NDArray[np.bool_]], NDArray[np.bool_]]:
    """Which pixels of a photo's SurfaceView belong to which material.

    photo_masks: name → (h, w) mask of the photo (capture_data.photo_masks). Returns ({material:
    (n,) its pixels}, (n,) pixels in one of the excluding masks).
    """
    masks = {name: mask.ravel().take(view.pixel) for name, mask in photo_masks.items()}
    out = np.zeros(len(view.pixel), bool)
    for name in EXCLUDED_MASKS:
        out |= masks.pop(name, out)
    found = {}
    for index, material in enumerate(capture.materials):
        found[material.name] = _one_material(capture, scan, view, material, index, masks)
    return found, out


def _one_material(
    capture: Capture,
    scan: Scan,
    view: SurfaceView,
    material: MaterialEntry,
    index: int,
    masks: dict[str, NDArray[np.bool_]],
) -> NDArray[np.bool_]:
    """(n,) pixels of one material, by its faces and masks; a material with neither gets the pixels
    that no other material claims."""
    pixels = np.ones(len(view.pixel), bool)
    attribute = face_attribute(material)
    if attribute is not None:
        pixels = scan.mesh.face_attributes[attribute][view.face] == index
    if material.name in masks:
        return pixels & masks[material.name]
    if attribute is not None:
        return pixels
    if any(capture.named_by_masks(m.name) for m in capture.materials) and not masks:
        return np.zeros_like(pixels)  # this photo has no masks, other photos do: unknown here
    if capture.named_by_masks(material.name):
        return np.zeros_like(pixels)
    for other, entry in enumerate(capture.materials):
        others = face_attribute(entry)
        if other != index and others is not None:
            pixels &= scan.mesh.face_attributes[others][view.face] != other
    for mask in masks.values():
        pixels &= ~mask
    return pixels
