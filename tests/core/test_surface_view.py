"""Values at the vertices of a mesh that show how its materials vary."""

from __future__ import annotations

import numpy as np
import pytest

from patina.core.scan import Mesh
from patina.core.varying.node_model import COUNT, DIFFUSE, GLOSS, SPECULAR, TILT
from patina.core.varying.surface_grid import SurfaceGrid
from patina.core.varying.varying_surface import (
    ALL_VARIATIONS,
    EVEN,
    VARIATIONS,
    MaterialVariation,
    VaryingSurface,
)
from patina.core.views.surface_view import QUANTITIES, at_vertices, shown_quantities
from tests.make_capture import sphere_mesh


def surface(kind: str = ALL_VARIATIONS, divisions: int = 3) -> VaryingSurface:
    """A sphere whose quantities are known functions of the place; its lower part is not seen."""
    vertices, faces = sphere_mesh(3)
    grid = SurfaceGrid.of(Mesh(vertices, faces.astype(np.int32)), divisions)
    x, _, z = (grid.points(slice(None)) - vertices.mean(axis=0)).T
    parameters = np.zeros((len(grid), COUNT), np.float32)
    parameters[:, DIFFUSE] = np.log(2.0) * x[:, None]
    parameters[:, SPECULAR] = -np.log(2.0) * x
    parameters[:, GLOSS] = 3.0
    parameters[:, TILT] = np.array([np.tan(np.radians(5.0)), 0, 0])
    even = [k for k in range(COUNT) if k not in VARIATIONS[kind]]
    parameters[:, even] = 0.0
    deviation = np.full_like(parameters, np.log(1.25))
    photos = np.where(z > -0.5, 3, 0).astype(np.uint16)
    return VaryingSurface(
        grid, parameters, deviation, photos, np.zeros(len(faces), np.uint8),
        (MaterialVariation(kind),),
    )  # fmt: skip


@pytest.mark.parametrize(
    ("kind", "expected"),
    [("diffuse", lambda x: x), ("specular", lambda x: -x), ("roughness", lambda x: 1 + 0 * x),
     ("normal", lambda x: 0.5 + 0 * x), ("error", lambda x: 0.5 + 0 * x)],
)  # fmt: skip
def test_values_are_those_of_the_surface(kind: str, expected) -> None:
    shown = surface()
    values, vertices = at_vertices(shown)[kind], shown.grid.mesh.vertices
    x, _, z = (vertices - vertices.mean(axis=0)).T
    np.testing.assert_allclose(values[z > -0.45], expected(x[z > -0.45]), atol=0.05)


@pytest.mark.parametrize("kind", QUANTITIES)
def test_unseen_vertices_have_no_value(kind: str) -> None:
    shown = surface()
    z = shown.grid.mesh.vertices[:, 2] - shown.grid.mesh.vertices[:, 2].mean()
    values = at_vertices(shown)[kind]
    assert np.isnan(values[z < -0.65]).all() and np.isfinite(values[z > -0.45]).all()
    low = -1 if QUANTITIES[kind].signed else 0
    assert np.nanmin(values) >= low and np.nanmax(values) <= 1


def test_only_what_varies_is_shown() -> None:
    assert shown_quantities(surface()) == list(QUANTITIES)
    assert shown_quantities(surface("diffuse")) == ["diffuse", "error"]
    assert shown_quantities(surface("diffuse and normals")) == ["diffuse", "normal", "error"]
    assert shown_quantities(surface(EVEN)) == []
