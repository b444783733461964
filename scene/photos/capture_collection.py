"""The collections of an imported capture."""

from __future__ import annotations

from collections.abc import Iterator

import bpy

from ..property_keys import CAPTURE


def collections_of(scene: bpy.types.Scene, capture: str | None) -> Iterator[bpy.types.Collection]:
    """The collections that a capture was imported into; none where capture is None."""
    for collection in scene.collection.children_recursive:
        if capture is not None and collection.get(CAPTURE) == capture:
            yield collection


def collection_of(scene: bpy.types.Scene, capture: str) -> bpy.types.Collection | None:
    """The first of these collections; None if they were deleted."""
    return next(collections_of(scene, capture), None)
