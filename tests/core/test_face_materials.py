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


def test_oklab_is_the_published_one() -> None:
    """The values of the space's author for XYZ, through sRGB primaries: white is (1, 0, 0)."""
    lab = oklab(np.array([[255, 255, 255], [0, 0, 0], [255, 0, 0], [0, 0, 255]], np.uint8))
    expected = [[1, 0, 0], [0, 0, 0], [0.62796, 0.22486, 0.12585], [0.45201, -0.03246, -0.31153]]
    assert np.allclose(lab, expected, atol=2e-4)


def test_faces_wear_the_colour_of_most_of_their_vertices() -> None:
    mesh = ball()
    upper = mesh.vertices[:, 2] > 0
    noise = np.random.default_rng(0).integers(-25, 26, (len(upper), 3))
    painted = np.where(upper[:, None], RED, BLUE) + noise
    mesh = replace(mesh, vertex_colours=np.clip(painted, 0, 255).astype(np.uint8))
    found = faces_by_vertex_colour(mesh, [BLUE, RED])
    assert found.dtype == np.int32
    assert np.array_equal(found, upper[mesh.faces].sum(axis=1) >= 2)
    # the order of the keys is the order of the numbers
    assert np.array_equal(faces_by_vertex_colour(mesh, [RED, GREEN, BLUE]), 2 * (1 - found))


def test_unpainted_vertices_are_of_none() -> None:
    mesh = Mesh(np.eye(3), np.array([[0, 1, 2]], np.int32))
    for colours, expected in (
        ((RED, RED, GREY), 0), ((RED, GREY, GREY), -1), ((GREY, GREY, GREY), -1),
        ((RED, BLUE, GREY), 0), ((225, 60, 60), 0),
    ):  # fmt: skip
        if np.ndim(colours) == 1:
            colours = (colours,) * 3
        painted = replace(mesh, vertex_colours=np.array(colours, np.uint8))
        assert faces_by_vertex_colour(painted, [RED, BLUE]).tolist() == [expected]


def square(corners: list[list[float]]) -> Mesh:
    """One triangle with these texture coordinates."""
    uv = np.array([corners], np.float32)
    return replace(Mesh(np.eye(3), np.array([[0, 1, 2]], np.int32)), uv=uv)


def test_v_goes_up_and_rows_go_down() -> None:
    image = np.zeros((10, 20, 3), np.uint8)
    image[:5, :10], image[:5, 10:], image[5:, :10], image[5:, 10:] = RED, GREEN, BLUE, GREY
    keys = [RED, GREEN, BLUE, GREY]
    for quarter, (u, v) in enumerate([(0.05, 0.55), (0.55, 0.55), (0.05, 0.05), (0.55, 0.05)]):
        mesh = square([[u, v], [u + 0.4, v], [u, v + 0.4]])
        assert faces_by_texture(mesh, image, keys).tolist() == [quarter]
        away = square([[u - 3, v + 2], [u - 2.6, v + 2], [u - 3, v + 2.4]])  # repeated
        assert faces_by_texture(away, image, keys).tolist() == [quarter]


@given(hnp.arrays(np.float64, (3, 2), elements=st.floats(0.02, 0.98)), st.floats(0.05, 0.95))
def test_a_face_is_what_covers_most_of_it(corners: np.ndarray, border: float) -> None:
    """A texture of two halves along u: the exact area left of the border decides, unless both
    parts are nearly equal or the triangle is thinner than the pixels."""
    image = np.empty((4, 1000, 3), np.uint8)
    image[:, : round(1000 * border)], image[:, round(1000 * border) :] = RED, BLUE
    left = share_left_of(corners, round(1000 * border) / 1000)
    if left is None or abs(left - 0.5) < 0.16:
        return
    found = faces_by_texture(square(corners.tolist()), image, [RED, BLUE])
    assert found.tolist() == [0 if left > 0.5 else 1]


def share_left_of(corners: np.ndarray, border: float) -> float | None:
    """The part of a triangle's area with u below a border, by cutting it there."""

    def area(points: np.ndarray) -> float:
        x, y = points.T
        return abs(np.sum(x * np.roll(y, -1) - y * np.roll(x, -1))) / 2

    if np.ptp(corners[:, 0]) < 0.05 or area(corners) < 1e-3:
        return None
    kept = []
    for p, q in zip(corners, np.roll(corners, -1, axis=0), strict=True):
        if p[0] <= border:
            kept.append(p)
        if (p[0] <= border) != (q[0] <= border):
            kept.append(p + (border - p[0]) / (q[0] - p[0]) * (q - p))
    return area(np.array(kept)) / area(corners) if len(kept) > 2 else 0.0


def test_many_faces_one_picture_each_its_pixel() -> None:
    """The ball unwrapped by longitude, in chunks: which side a face lies on is known exactly."""
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
    north = corners[..., 1] > 1e-6  # u > ½
    whole = (np.ptp(u, axis=1) < 0.2) & (north.all(axis=1) | (corners[..., 1] < -1e-6).all(axis=1))
    assert whole.mean() > 0.95
    assert np.array_equal(found[whole] == 0, north[whole, 0])


def test_only_the_faces_that_wear_the_texture() -> None:
    mesh = ball(1)
    mesh = replace(mesh, uv=np.full((len(mesh.faces), 3, 2), 0.5, np.float32))
    image = np.full((2, 2, 3), RED, np.uint8)
    wearing = np.arange(len(mesh.faces)) % 2 == 0
    found = faces_by_texture(mesh, image, [RED], faces=wearing)
    assert np.array_equal(found, np.where(wearing, 0, -1))
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
def test_wrong_keys(colours: list, message: str) -> None:
    mesh = ball(0)
    painted = replace(mesh, vertex_colours=np.zeros((12, 3), np.uint8))
    with pytest.raises(InputError, match=message):
        faces_by_vertex_colour(painted, colours)


def test_meshes_without_paint() -> None:
    with pytest.raises(InputError, match="vertex colours"):
        faces_by_vertex_colour(ball(0), [RED])
    with pytest.raises(InputError, match="texture coordinates"):
        faces_by_texture(ball(0), np.zeros((2, 2, 3), np.uint8), [RED])
    with pytest.raises(InputError, match="8-bit RGB"):
        faces_by_texture(square([[0, 0], [1, 0], [0, 1]]), np.zeros((2, 2), np.uint8), [RED])
