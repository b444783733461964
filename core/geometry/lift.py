"""How far above the mesh a shadow ray starts, so that the surface does not shadow itself.

A scanned surface is rough at the scale of its triangles, and smooth normals let light fall on
facets that are turned away from it. What is far enough for every scan hides contact shadows
though: where light grazes a surface at cos θi = 0.1, a shadow begins ten times the lift too late.
"""

from __future__ import annotations

import numpy as np

from ..scan import Mesh

SHADOW_LIFT = 5e-4  # of the object's size: enough for every scan
LEAST = 2e-5  # of the object's size: what float32 leaves


def facet_lift(mesh: Mesh) -> float:
    """Scan units, never more than SHADOW_LIFT of the object's size: as far as the smooth surface,
    which the normals at a facet's corners tell of, stands above the middle of a usual one (Hanika
    2021, "Hacking the shadow terminator")."""
    corner = mesh.vertices[mesh.faces]
    middle = corner.mean(axis=1)
    normal = mesh.vertex_normals[mesh.faces]
    above = np.einsum("fvi,fvi->fv", corner - middle[:, None], normal).max(axis=1)
    height = float(np.median(np.maximum(above, 0)))
    return float(np.clip(height, LEAST * mesh.size, SHADOW_LIFT * mesh.size))
