"""Distance of a shadow ray's start from the mesh, so that the surface does not shadow itself.

A scanned surface is rough at the scale of its triangles, and smooth normals let light reach facets
that face away from it. A distance that suffices for every scan hides contact shadows: at grazing
incidence, cos θi = 0.1, a shadow begins ten times that distance too late.
"""

from __future__ import annotations

import numpy as np

from ..scan import Mesh

SHADOW_LIFT = 5e-4  # fraction of the object's size that suffices for every scan
MIN_LIFT = 2e-5  # fraction of the object's size, the precision of float32


def facet_lift(mesh: Mesh) -> float:
    """Ray offset in scan units: the median height of the smooth surface, implied by the normals at
    a facet's corners, above the facet's centre (Hanika 2021, "Hacking the shadow terminator");
    between MIN_LIFT and SHADOW_LIFT of the object's size."""
    corner = mesh.vertices[mesh.faces]
    middle = corner.mean(axis=1)
    normal = mesh.vertex_normals[mesh.faces]
    above = np.einsum("fvi,fvi->fv", corner - middle[:, None], normal).max(axis=1)
    height = float(np.median(np.maximum(above, 0)))
    return float(np.clip(height, MIN_LIFT * mesh.size, SHADOW_LIFT * mesh.size))
