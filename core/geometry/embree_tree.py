"""Embree's acceleration structure of a mesh, built when it is first used."""

from __future__ import annotations

import threading
from typing import Any, ClassVar

import numpy as np
from embreex.mesh_construction import TriangleMesh
from embreex.rtcore_scene import EmbreeScene
from numpy.typing import NDArray

from ..scan import Mesh

_building = threading.Lock()


class EmbreeTree:
    """The structure of a mesh, relative to ``origin``, in float32. In another process it is built
    again when it is used."""

    STORED_APART: ClassVar[bool] = True

    def __init__(self, mesh: Mesh, origin: NDArray[np.float64]) -> None:
        self._mesh, self._origin = mesh, origin
        self._scene: EmbreeScene | None = None

    @property
    def scene(self) -> EmbreeScene:
        """Embree's scene."""
        if self._scene is None:
            with _building:
                if self._scene is None:
                    self._scene = self._built()
        return self._scene

    def __getstate__(self) -> dict[str, Any]:
        """Embree's scene cannot be stored."""
        return {**vars(self), "_scene": None}

    def _built(self) -> EmbreeScene:
        scene = EmbreeScene()
        triangles = (self._mesh.vertices - self._origin).astype(np.float32)[self._mesh.faces]
        TriangleMesh(scene, np.ascontiguousarray(triangles))
        del triangles
        one = np.zeros((1, 3), np.float32)
        scene.run(one, one + 1)  # Embree builds the tree at the first ray
        return scene
