"""A capture whose only material was separated into several by their reflectance."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from ..capture import Capture, MaterialEntry
from ..scan import Scan

SEPARATED = "patina_separated"  # face attribute: index of the material of each face


def can_separate(capture: Capture) -> bool:
    """Whether the capture has one material, that no faces locate, and masks, if any, locate in all
    photos."""
    only = capture.materials[0]
    masked = [only.name in photo.masks for photo in capture.photos]
    return len(capture.materials) == 1 and not only.by_mesh and all(masked) == any(masked)


def separated_names(name: str, count: int) -> tuple[str, ...]:
    """The names of the parts of a material."""
    return tuple(f"{name}_{number + 1}" for number in range(count))


def with_separated(capture: Capture, names: Sequence[str]) -> Capture:
    """The capture with materials of these names, which the faces of ``separated_scan`` locate, and
    in each photo the mask of the only material before, if there was one."""
    only = capture.materials[0].name
    materials = tuple(MaterialEntry(name, faces=SEPARATED) for name in names)
    photos = tuple(
        replace(photo, masks=_masks(photo.masks, only, names)) for photo in capture.photos
    )
    return replace(capture, materials=materials, photos=photos)


def without_separated(capture: Capture, whole: Capture) -> Capture:
    """The capture with the only material of ``whole``, the capture before ``with_separated``."""
    photos = tuple(
        replace(photo, masks=before.masks)
        for photo, before in zip(capture.photos, whole.photos, strict=True)
    )
    return replace(capture, materials=whole.materials, photos=photos)


@dataclass(frozen=True)
class SeparatedFaces:
    """Gives a scan that is read the material of each face. labels: (f,) index, −1 for none;
    earlier: is applied first."""

    labels: NDArray[np.integer]
    earlier: Callable[[Scan], Scan] | None = None

    def __call__(self, scan: Scan) -> Scan:
        return separated_scan(scan if self.earlier is None else self.earlier(scan), self.labels)


def _masks(masks: dict[str, Path], only: str, names: Sequence[str]) -> dict[str, Path]:
    """The masks of a photo, that of the material ``only`` for all ``names``."""
    others = {name: file for name, file in masks.items() if name != only}
    return {**others, **({name: masks[only] for name in names} if only in masks else {})}


def separated_scan(scan: Scan, face_material: NDArray[np.integer]) -> Scan:
    """The scan with the material of each face. face_material: (f,) index."""
    attributes = {**scan.mesh.face_attributes, SEPARATED: face_material.astype(np.int32)}
    return replace(scan, mesh=replace(scan.mesh, face_attributes=attributes))
