"""Maps of a surface whose variation is known: each texel has the parameters of its place."""

from __future__ import annotations

import json
from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest

from patina.core.appearance.principled import Principled
from patina.core.basis import PrincipalBRDF
from patina.core.maps.maps_result import MapsResult, baked_maps
from patina.core.maps.material import MapMaterial
from patina.core.maps.texels import rasterise
from patina.core.maps.write import (
    base_color,
    roughness,
    specular,
    specular_tint,
    write_maps,
)
from patina.core.scan import Mesh
from patina.core.varying.node_model import COUNT, GLOSS, SPECULAR, TINT, TINTS
from patina.core.varying.surface_grid import SurfaceGrid
from patina.core.varying.varying_surface import MaterialVariation, VaryingSurface
from tests.projected import projected

CELLS = 8  # of the square, along each side
EVERYTHING = "diffuse, specular, gloss and normals"
FITTED = Principled(base_color=np.array([0.3, 0.2, 0.1]), roughness=0.5, specular_ior_level=0.4)


def square(turn: float = 0.0) -> Mesh:
    """The unit square in the plane z = 0; its texture is turned by an angle about its centre."""
    x, y = np.meshgrid(np.linspace(0, 1, CELLS + 1), np.linspace(0, 1, CELLS + 1))
    points = np.stack([x.ravel(), y.ravel(), np.zeros(x.size)], axis=1)
    row, column = (a.ravel() for a in np.indices((CELLS, CELLS)))
    a = row * (CELLS + 1) + column
    b, c, d = a + 1, a + CELLS + 2, a + CELLS + 1
    faces = np.concatenate([np.stack([a, b, c], 1), np.stack([a, c, d], 1)]).astype(np.int32)
    uv = 0.6 * (points[:, :2] - 0.5)
    rotation = np.array([[np.cos(turn), -np.sin(turn)], [np.sin(turn), np.cos(turn)]])
    uv = (uv @ rotation.T + 0.5).astype(np.float32)
    return Mesh(points, faces, uv=uv[faces])


def surface(mesh: Mesh, materials: int = 1) -> VaryingSurface:
    """Parameters that are linear in the position; the right half is of the second material."""
    grid = SurfaceGrid.of(mesh, 3)
    x, y, _ = grid.points(slice(None)).T
    parameters = np.zeros((len(grid), COUNT), np.float32)
    parameters[:, 0], parameters[:, 1], parameters[:, 2] = 0.4 * x, -0.2 * y, 0.1
    parameters[:, SPECULAR], parameters[:, GLOSS] = 0.5 * y, 0.3 * x - 0.1
    parameters[:, 5] = 0.1  # towards +x
    parameters[:, TINT.start] = 0.2 * x  # red highlights
    deviation = np.full((len(grid), COUNT), 0.07, np.float32)
    centre = mesh.vertices[mesh.faces].mean(axis=1)
    side = (centre[:, 0] > 0.5) if materials > 1 else np.zeros(len(centre), bool)
    kinds = (MaterialVariation(EVERYTHING),) * materials
    photos = np.full(len(grid), 5, np.uint16)
    return VaryingSurface(grid, parameters, deviation, photos, side.astype(np.uint8), kinds)


@pytest.fixture(scope="module")
def brdf() -> PrincipalBRDF:
    return projected(FITTED.evaluate, 20)


def baked(
    mesh: Mesh, brdf: PrincipalBRDF, materials: int = 1, fitted: Principled = FITTED
) -> MapsResult:
    own = tuple(MapMaterial(f"m{i}", brdf, fitted, 1.0, 0.0) for i in range(materials))
    texels = rasterise(mesh, 64)
    scan = SimpleNamespace(mesh=mesh)
    capture = SimpleNamespace(file="square.capture.toml")
    return baked_maps(capture, scan, texels, surface(mesh, materials), own, False)


def test_maps_have_the_parameters_of_each_place(brdf):
    mesh = square()
    result = baked(mesh, brdf)
    x, y, _ = result.texels.points(mesh, slice(None)).T
    expected = FITTED.base_color * np.exp(np.stack([0.4 * x, -0.2 * y, 0.1 + 0 * x], axis=1))
    assert base_color(result, 0) == pytest.approx(expected, rel=2e-3)
    red, green, blue = (TINTS[0] * 0.2 * x[:, None]).T
    assert specular(result, 0) == pytest.approx(0.4 * np.exp(0.5 * y + red), rel=2e-3)
    tint = np.exp(np.stack([0 * red, green - red, blue - red], axis=1))
    assert specular_tint(result, 0) == pytest.approx(tint, rel=2e-3)
    assert roughness(result, 0) == pytest.approx(0.5 * np.exp(0.5 * (0.3 * x - 0.1)), rel=2e-3)
    assert result.maps.error == pytest.approx(0.07, rel=1e-3)
    assert (result.maps.photos == 5).all()


def test_base_colour_of_a_metal_is_that_of_its_highlights():
    mesh, copper = square(), replace(FITTED, metallic=1.0, roughness=0.4)
    metal = projected(copper.evaluate, 20)
    result = baked(mesh, metal, fitted=copper)
    level = result.levels[0]
    assert level.split.mostly_specular and not level.split.whole
    x, y, _ = result.texels.points(mesh, slice(None)).T
    tint = TINTS[0] * 0.2 * x[:, None]
    highlights = copper.base_color * np.exp(0.5 * y[:, None] + tint)
    assert result.materials[0].principled.metallic == 1
    # a small part of the light is in the tail of the lobe, which counts as diffuse
    assert base_color(result, 0) == pytest.approx(np.clip(highlights, 0, 1), rel=0.1)
    assert specular_tint(result, 0) == pytest.approx(1.0)


@pytest.mark.parametrize("turn", [0.0, 0.7])
def test_normal_map_is_in_the_frame_of_the_texture(brdf, turn):
    result = baked(square(turn), brdf)
    tilt = 0.1 / np.hypot(1, 0.1)
    expected = [tilt * np.cos(turn), tilt * np.sin(turn), 1 / np.hypot(1, 0.1)]
    assert result.normal == pytest.approx(np.tile(expected, (len(result.normal), 1)), abs=2e-3)


def test_materials_keep_to_their_faces(brdf):
    mesh = square()
    result = baked(mesh, brdf, materials=2)
    x = result.texels.points(mesh, slice(None))[:, 0]
    first, second = result.maps.materials
    assert first.share + second.share == pytest.approx(1.0, abs=1e-5)
    assert (first.share[x < 0.5 - 1 / CELLS] == 1).all()
    assert (second.share[x > 0.5 + 1 / CELLS] == 1).all()
    # elsewhere a map has the typical value of its own faces
    assert first.scale[x > 0.7, 0] == pytest.approx(np.exp(0.1), rel=0.02)
    assert second.scale[x < 0.3, 0] == pytest.approx(np.exp(0.3), rel=0.02)


@pytest.mark.parametrize("names", [("m0", "blend"), ("m0", "M0_specular"), ("m0", "m1")])
def test_every_map_has_a_file_of_its_own(brdf, tmp_path, names):
    result = baked(square(), brdf, materials=2)
    own = tuple(replace(m, name=n) for m, n in zip(result.materials, names, strict=True))
    files = write_maps(tmp_path, replace(result, materials=own), "exr")
    assert len({file.file.casefold() for file in files}) == len(files)
    assert all((tmp_path / file.file).is_file() for file in files)
    assert {file.material for file in files} >= set(names)


def test_parameters_do_not_cross_the_border_of_materials():
    mesh = square()
    made = surface(mesh, materials=2)
    rows = made.face_material[np.maximum(made.grid.places[0], 0)]
    parameters = np.where(rows[:, None] == 1, 2.0, -1.0) * np.ones((1, COUNT))
    made = replace(made, parameters=parameters.astype(np.float32))
    rng = np.random.default_rng(0)
    face = rng.integers(0, len(mesh.faces), 2000)
    second = rng.random(len(face))
    third = rng.random(len(face)) * (1 - second)
    expected = np.where(made.face_material[face] == 1, 2.0, -1.0)
    found = made.at(face, second, third)[:, 0]
    assert found == pytest.approx(expected)


def test_files_hold_the_factors_of_the_shader(brdf, tmp_path):
    files = write_maps(tmp_path, baked(square(), brdf), "exr")
    kinds = {file.kind for file in files}
    assert {
        "scale",
        "specular_scale",
        "roughness_scale",
        "specular",
        "specular_tint",
        "normal",
    } <= kinds
    assert all((tmp_path / file.file).is_file() for file in files)
    record = json.loads((tmp_path / "maps.json").read_text())
    assert record["normals_turned"]["median"] == pytest.approx(np.degrees(np.arctan(0.1)), abs=0.05)
    assert record["highlight_seen"] == 1.0
