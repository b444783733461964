"""Geometry and samples, against a sphere traced analytically by the quadratic formula."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from patina.core.angles import half_difference
from patina.core.capture import read_capture
from patina.core.geometry import RayScene, edges, view_surface
from patina.core.geometry.curvature import mean_curvature
from patina.core.inputs import capture_data
from patina.core.inputs.lights import find_lights
from patina.core.inputs.photos import LitPhotos
from patina.core.samples import Margins, SampleTable
from patina.core.samples.face_votes import FaceVotes
from patina.core.samples.take import light_surface, trusted_pixels
from patina.core.scan import Mesh
from tests import make_capture as made
from tests.sampled import sampled


@pytest.fixture(scope="module")
def ball(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return made.make_capture(tmp_path_factory.mktemp("ball"))


@pytest.fixture(scope="module")
def tables(ball: Path) -> tuple[SampleTable, list]:
    return sampled(ball)


def test_samples_have_true_reflectance(tables: tuple[SampleTable, list]) -> None:
    table, _ = tables
    light = table.light.astype(float)
    truth = made.blinn(table.normal, light, table.view)
    ratio = table.rho / truth
    assert len(table) > 5000
    assert abs(np.median(ratio) - 1) < 1e-3
    assert np.percentile(np.abs(ratio - 1), 95) < 0.02  # the mesh has facets, the sphere does not


def test_points_and_normals_lie_on_sphere(tables: tuple[SampleTable, list]) -> None:
    for view in tables[1]:
        radius = np.linalg.norm(view.point - made.CENTRE, axis=1)
        assert np.abs(radius - 1).max() < 2e-3
        exact = (view.point - made.CENTRE) / radius[:, None]
        away = np.degrees(np.arccos(np.clip(np.sum(exact * view.normal, axis=1), -1, 1)))
        assert np.percentile(away, 99) < 0.2


def test_table_angles_agree_with_its_vectors(tables: tuple[SampleTable, list]) -> None:
    table, _ = tables
    again = half_difference(
        table.normal.astype(float), table.light.astype(float), table.view.astype(float)
    )
    assert np.allclose(again.theta_h, table.theta_h, atol=1e-5)
    assert np.allclose(again.theta_d, table.theta_d, atol=1e-5)


def test_curvature_of_sphere_is_inverse_radius_in_pixels(tables: tuple[SampleTable, list]) -> None:
    """Where the sphere faces the camera, 1/curvature is its radius in pixels."""
    view = tables[1][0]
    facing = np.einsum("ij,ij->i", view.normal, view.view) > 0.995
    pixels = made.FOCAL / (made.DISTANCE - 1.0)  # of one unit at the nearest point
    assert np.median(np.abs(view.curvature[facing])) == pytest.approx(1 / pixels, rel=0.06)


def test_curvature_of_plane_and_sine_wave() -> None:
    x = np.arange(60)[None, :] * np.ones((40, 1))
    slope = 0.3 * np.cos(x / 5)  # depth 1.5 sin(x/5)
    normal = np.dstack([-slope, np.zeros_like(slope), np.ones_like(slope)])
    normal /= np.linalg.norm(normal, axis=2, keepdims=True)
    found = mean_curvature(normal)
    expected = -0.5 * 0.06 * np.sin(x / 5)
    assert np.isnan(found[0]).all()
    assert np.abs(found - expected)[1:-1, 1:-1].max() < 0.001
    assert np.nanmax(np.abs(mean_curvature(np.full((9, 9, 3), 1 / np.sqrt(3))))) < 1e-6


def test_cast_shadow_lies_where_geometry_predicts() -> None:
    """A sphere over a plane, light from 45°: the shadow's centre is one sphere height away."""
    vertices, faces = made.sphere_mesh(4)
    vertices = 0.3 * (vertices - made.CENTRE) + [0, 0, 1.0]
    floor = np.array([[-3, -3, 0], [3, -3, 0], [3, 3, 0], [-3, 3, 0]], float)
    mesh = Mesh(
        np.concatenate([vertices, floor]),
        np.concatenate([faces, np.array([[0, 1, 2], [0, 2, 3]]) + len(vertices)]).astype(np.int32),
    )
    rays = RayScene.build(mesh)
    x = np.linspace(-2, 2, 401)
    points = np.stack([x, np.zeros_like(x), np.full_like(x, 1e-4)], axis=1)
    dark = rays.occluded(points, np.array([np.sqrt(0.5), 0, np.sqrt(0.5)]))
    half = 0.3 * np.sqrt(2)
    assert x[dark].min() == pytest.approx(-1 - half, abs=0.02)
    assert x[dark].max() == pytest.approx(-1 + half, abs=0.02)


def test_silhouettes_are_depth_jumps_not_steep_slopes() -> None:
    depth = np.full((20, 30), np.nan)
    depth[4:16, 4:26] = 3.0 + 0.02 * np.arange(22)  # steep, but one continuous surface
    depth[4:16, 15:26] += 1.0
    found = edges.silhouette(depth, np.full(depth.shape, 0.01))
    assert found[10, 14] and found[10, 15] and found[4, 10] and found[3, 10]
    assert not found[10, 8] and not found[10, 20]
    assert edges.widen(found, 2)[10, 12] and not edges.widen(found, 2)[10, 10]


def test_faces_get_material_by_majority_of_pixels() -> None:
    vertices = np.array([[0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 1, 0], [5, 0, 0], [5, 1, 0]], float)
    mesh = Mesh(vertices, np.array([[0, 1, 2], [0, 2, 3], [1, 4, 5]], np.int32))
    votes = FaceVotes.empty(3, 2)
    votes.add(0, np.array([0, 0, 0, 1]))
    votes.add(1, np.array([0, 1, 1]))
    # no pixel shows the last face: it takes its neighbour's material
    assert votes.winners(mesh).tolist() == [0, 1, 0]


def test_margins_exclude_outlines_shadow_edges_and_grazing_angles(ball: Path) -> None:
    """With margins no sample lies at an outline, a shadow edge or a grazing angle."""
    capture = read_capture(ball)
    scan = capture_data.open_scan(capture)
    rays = RayScene.build(scan.mesh)
    camera = capture_data.camera_of(capture, scan, 1)
    view = view_surface(rays, camera)
    light = find_lights(capture, scan, LitPhotos.open(capture)).of(capture, 1)
    lighting = light_surface(rays, view, light, camera)
    lit = view.image(~lighting.shadowed, fill=0).astype(bool)
    terminator = edges.shadow_edge(lit, view.seen)
    wide = trusted_pixels(view, lighting, Margins())
    none = trusted_pixels(view, lighting, Margins(silhouette=0, shadow=0, cosine=0.001))
    for edge, distance in ((view.silhouette, 2), (terminator, 3)):
        near = edges.widen(edge, distance - 1).ravel()[view.pixel]
        assert not wide[near].any()
        assert none[near].any()
    assert lighting.cos_i[wide].min() > 0.1 > lighting.cos_i[none].min()
    assert none.sum() > wide.sum() > 0.5 * none.sum()


def test_mask_borders_are_excluded() -> None:
    part = np.zeros((9, 12), bool)
    seen = np.ones((9, 12), bool)
    seen[:, 10:] = False
    part[:, 5:10] = True
    inner = edges.inside(part, seen, 1)
    assert not inner[:, 5].any() and inner[:, 6:10].all()  # an outline is not a mask border
    assert np.array_equal(edges.inside(part, seen, 0), part)
