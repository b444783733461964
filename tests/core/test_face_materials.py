"""Materials painted onto the mesh: vertex colours and textures."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from hypothesis.extra import numpy as hnp

from patina.core.errors import InputError
from patina.core.inputs.oklab import oklab
from patina.core.inputs.painted_faces import faces_by_texture, faces_by_vertex_colour
from patina.core.scan import Mesh
from tests.make_capture import CENTRE, sphere_mesh

RED, GREEN, BLUE, GREY = (220, 30, 30), (40, 200, 60), (30, 40, 220), (128, 128, 128)


def ball(subdivisions: int = 3) -> Mesh:
    vertices, faces = sphere_mesh(subdivisions)
    return Mesh(vertices - CENTRE, faces.astype(np.int32))


def test_oklab_matches_published_values() -> None:
    """Reference values of sRGB colours by the published definition of Oklab; white is (1, 0, 0)."""
    lab = oklab(np.array([[255, 255, 255], [0, 0, 0], [255, 0, 0], [0, 0, 255]], np.uint8))
    expected = [[1, 0, 0], [0, 0, 0], [0.62796, 0.22486, 0.12585], [0.45201, -0.03246, -0.31153]]
    assert np.allclose(lab, expected, atol=2e-4)


def test_majority_of_vertex_colours_decides_the_face() -> None:
    mesh = ball()
    is_upper = mesh.vertices[:, 2] > 0
    noise = np.random.default_rng(0).integers(-25, 26, (len(is_upper), 3))
    painted = np.where(is_upper[:, None], RED, BLUE) + noise
    mesh = replace(mesh, vertex_colours=np.clip(painted, 0, 255).astype(np.uint8))
    found = faces_by_vertex_colour(mesh, [BLUE, RED])
    assert found.dtype == np.int32
    assert np.array_equal(found, is_upper[mesh.faces].sum(axis=1) >= 2)
    # the material numbers follow the order of the key colours
    assert np.array_equal(faces_by_vertex_colour(mesh, [RED, GREEN, BLUE]), 2 * (1 - found))


def test_unpainted_vertices_belong_to_no_material() -> None:
    mesh = Mesh(np.eye(3), np.array([[0, 1, 2]], np.int32))
    for colours, expected in (
        ((RED, RED, GREY), 0), ((RED, GREY, GREY), -1), ((GREY, GREY, GREY), -1),
        ((RED, BLUE, GREY), 0), ((225, 60, 60), 0),
    ):  # fmt: skip
        if np.ndim(colours) == 1:
            colours = (colours,) * 3
        painted = replace(mesh, vertex_colours=np.array(colours, np.uint8))
        assert faces_by_vertex_colour(painted, [RED, BLUE]).tolist() == [expected]


def textured_triangle(corners: list[list[float]]) -> Mesh:
    """One triangle with these texture coordinates."""
    uv = np.array([corners], np.float32)
    return replace(Mesh(np.eye(3), np.array([[0, 1, 2]], np.int32)), uv=uv)


def test_texture_v_axis_points_up() -> None:
    image = np.zeros((10, 20, 3), np.uint8)
    image[:5, :10], image[:5, 10:], image[5:, :10], image[5:, 10:] = RED, GREEN, BLUE, GREY
    keys = [RED, GREEN, BLUE, GREY]
    for expected, (u, v) in enumerate([(0.05, 0.55), (0.55, 0.55), (0.05, 0.05), (0.55, 0.05)]):
        mesh = textured_triangle([[u, v], [u + 0.4, v], [u, v + 0.4]])
        assert faces_by_texture(mesh, image, keys).tolist() == [expected]
        # the texture repeats outside [0, 1]
        shifted = textured_triangle([[u - 3, v + 2], [u - 2.6, v + 2], [u - 3, v + 2.4]])
        assert faces_by_texture(shifted, image, keys).tolist() == [expected]


@given(hnp.arrays(np.float64, (3, 2), elements=st.floats(0.02, 0.98)), st.floats(0.05, 0.95))
def test_largest_texture_area_decides_the_face(corners: np.ndarray, border: float) -> None:
    """A texture split along u: the larger area decides, computed exactly here, unless both parts
    are nearly equal or the triangle is thinner than a pixel."""
    image = np.empty((4, 1000, 3), np.uint8)
    image[:, : round(1000 * border)], image[:, round(1000 * border) :] = RED, BLUE
    left_share = share_left_of(corners, round(1000 * border) / 1000)
    if left_share is None or abs(left_share - 0.5) < 0.16:
        return
    found = faces_by_texture(textured_triangle(corners.tolist()), image, [RED, BLUE])
    assert found.tolist() == [0 if left_share > 0.5 else 1]


def share_left_of(corners: np.ndarray, border: float) -> float | None:
    """The fraction of a triangle's area with u below the border, by clipping the triangle; None if
    the triangle is too thin."""

    def area(points: np.ndarray) -> float:
        x, y = points.T
        return abs(np.sum(x * np.roll(y, -1) - y * np.roll(x, -1))) / 2

    if np.ptp(corners[:, 0]) < 0.05 or area(corners) < 1e-3:
        return None
    clipped_corners = []
    for p, q in zip(corners, np.roll(corners, -1, axis=0), strict=True):
        if p[0] <= border:
            clipped_corners.append(p)
        if (p[0] <= border) != (q[0] <= border):
            clipped_corners.append(p + (border - p[0]) / (q[0] - p[0]) * (q - p))
    return area(np.array(clipped_corners)) / area(corners) if len(clipped_corners) > 2 else 0.0


def test_texture_lookup_of_many_faces() -> None:
    """A large mesh is processed in chunks; the ball is unwrapped by longitude."""
    mesh = ball(6)
    assert len(mesh.faces) > 1 << 16
    corners = mesh.vertices[mesh.faces]
    u = np.arctan2(corners[..., 1], corners[..., 0]) / (2 * np.pi) + 0.5
    v = np.arccos(np.clip(corners[..., 2], -1, 1)) / np.pi
    image = np.empty((8, 512, 3), np.uint8)
    image[:, :256], image[:, 256:] = RED, GREEN
    found = faces_by_texture(
        replace(mesh, uv=np.stack([u, v], axis=-1).astype(np.float32)), image, [GREEN, RED]
    )
    is_north = corners[..., 1] > 1e-6  # u > ½
    unambiguous = (np.ptp(u, axis=1) < 0.2) & (
        is_north.all(axis=1) | (corners[..., 1] < -1e-6).all(axis=1)
    )
    assert unambiguous.mean() > 0.95
    assert np.array_equal(found[unambiguous] == 0, is_north[unambiguous, 0])


def test_only_faces_with_the_texture_are_assigned() -> None:
    mesh = ball(1)
    mesh = replace(mesh, uv=np.full((len(mesh.faces), 3, 2), 0.5, np.float32))
    image = np.full((2, 2, 3), RED, np.uint8)
    has_texture = np.arange(len(mesh.faces)) % 2 == 0
    found = faces_by_texture(mesh, image, [RED], faces=has_texture)
    assert np.array_equal(found, np.where(has_texture, 0, -1))
    assert (faces_by_texture(mesh, image, [BLUE]) == -1).all()


@pytest.mark.parametrize(
    ("colours", "message"),
    [
        ([(1, 2)], "three numbers"),
        ([], "three numbers"),
        ([(0, 0, 256)], "three numbers"),
        ([(0, 0, float("nan"))], "three numbers"),
        (["red"], "three numbers"),
        ([RED, RED], "same key colour"),
    ],
)
def test_invalid_key_colours_are_rejected(colours: list, message: str) -> None:
    mesh = ball(0)
    painted = replace(mesh, vertex_colours=np.zeros((12, 3), np.uint8))
    with pytest.raises(InputError, match=message):
        faces_by_vertex_colour(painted, colours)


def test_missing_colours_or_texture_are_rejected() -> None:
    with pytest.raises(InputError, match="vertex colours"):
        faces_by_vertex_colour(ball(0), [RED])
    with pytest.raises(InputError, match="texture coordinates"):
        faces_by_texture(ball(0), np.zeros((2, 2, 3), np.uint8), [RED])
    with pytest.raises(InputError, match="8-bit RGB"):
        faces_by_texture(
            textured_triangle([[0, 0], [1, 0], [0, 1]]), np.zeros((2, 2), np.uint8), [RED]
        )
