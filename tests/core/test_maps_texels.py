"""Texels of a texture: areas, each centre in exactly one triangle, surface positions, margins."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import example, given, settings
from hypothesis import strategies as st
from scipy.spatial import Delaunay

from patina.core.errors import InputError
from patina.core.maps import rasterise
from patina.core.maps.dilate import dilated, margin_of
from patina.core.scan import Mesh


def flat_mesh(uv, faces):
    """A flat mesh whose points are its texture coordinates in scan units."""
    points = np.concatenate([uv, np.zeros((len(uv), 1))], axis=1)
    return Mesh(points, np.asarray(faces, np.int32), uv=uv[faces].astype(np.float32))


def test_rectangle_covers_its_area_with_correct_surface_points():
    uv = np.array([[0.25, 0.25], [0.75, 0.25], [0.75, 0.5], [0.25, 0.5]])
    texels = rasterise(flat_mesh(uv, [[0, 1, 2], [0, 2, 3]]), 64)
    assert len(texels) == 32 * 16 and texels.overlapped == 0 and texels.outside == 0
    row, column = np.divmod(texels.place, 64)
    assert (row.min(), row.max()) == (32, 47)  # v = 0.25 … 0.5 from below: rows count from the top
    assert (column.min(), column.max()) == (16, 47)
    mesh = flat_mesh(uv, [[0, 1, 2], [0, 2, 3]])
    points = texels.points(mesh, slice(None))
    assert np.allclose(points[:, 0], (column + 0.5) / 64, atol=1e-6)
    assert np.allclose(points[:, 1], 1 - (row + 0.5) / 64, atol=1e-6)


@settings(max_examples=40, deadline=None)
@given(st.integers(0, 2**32 - 1), st.sampled_from([16, 33, 64]), st.booleans())
@example(0, 16, True)  # face corners on texel centres
def test_each_texel_centre_lies_in_exactly_one_triangle(seed, size, on_centres):
    rng = np.random.default_rng(seed)
    points = rng.random((20, 2))
    if on_centres:  # the hardest case: edges and corners pass through texel centres
        points = (np.floor(points * size) + 0.5) / size
    points = np.unique(np.concatenate([points, [[0, 0], [1, 0], [1, 1], [0, 1]]]), axis=0)
    faces = Delaunay(points).simplices
    texels = rasterise(flat_mesh(points, faces), size)
    assert np.array_equal(np.sort(texels.place), np.arange(size * size))
    assert texels.overlapped == 0


def test_mirrored_uv_islands_are_covered_equally():
    uv = np.array([[0.1, 0.1], [0.9, 0.2], [0.4, 0.8]])
    one = rasterise(flat_mesh(uv, [[0, 1, 2]]), 128)
    other = rasterise(flat_mesh(uv, [[0, 2, 1]]), 128)
    assert np.array_equal(one.place, other.place)
    area = 0.5 * abs(np.cross(uv[1] - uv[0], uv[2] - uv[0])) * 128**2
    assert abs(len(one) - area) < 0.01 * area


def test_overlapping_faces_are_counted_and_first_face_is_used():
    uv = np.array([[0, 0], [1, 0], [1, 1], [0, 1], [0, 0], [0.5, 0], [0, 0.5]], float)
    mesh = flat_mesh(uv, [[0, 1, 2], [0, 2, 3], [4, 5, 6]])
    texels = rasterise(mesh, 32)
    assert len(texels) == 32 * 32
    assert 0.9 * 128 < texels.overlapped < 1.1 * 128  # one eighth of the texture
    assert set(texels.face.tolist()) == {0, 1}


def test_texture_with_more_rows_than_one_block(monkeypatch):
    from patina.core.maps import texels as module

    rng = np.random.default_rng(1)
    points = np.concatenate([rng.random((30, 2)), [[0, 0], [1, 0], [1, 1], [0, 1]]])
    mesh = flat_mesh(points, Delaunay(points).simplices)
    whole = rasterise(mesh, 64)
    monkeypatch.setattr(module, "BAND", 64 * 7)
    monkeypatch.setattr(module, "TEXELS_AT_ONCE", 50)
    parts = rasterise(mesh, 64)
    assert np.array_equal(whole.place, parts.place) and np.array_equal(whole.face, parts.face)
    assert np.array_equal(whole.second, parts.second)


def test_mesh_without_texture_coordinates_error_says_what_to_do():
    mesh = Mesh(np.eye(3), np.array([[0, 1, 2]], np.int32))
    with pytest.raises(InputError, match=r"no texture coordinates.*unwrap"):
        rasterise(mesh, 64)


@pytest.mark.parametrize("shift", [1.5, -3.0, 1e30])
def test_coordinates_outside_texture_are_rejected_with_their_count(shift):
    uv = np.array([[0, 0], [1, 0], [0, 1]], float) + shift
    with pytest.raises(InputError, match=r"cover no texel.*1 of 1 faces"):
        rasterise(flat_mesh(uv, [[0, 1, 2]]), 64)


def test_thousand_overlapping_layers_are_rejected_early():
    uv = np.array([[0, 0], [1, 0], [1, 1]], float)
    mesh = flat_mesh(uv, np.tile([[0, 1, 2]], (1000, 1)))
    with pytest.raises(InputError, match="cover the texture"):
        rasterise(mesh, 8192)


@pytest.mark.parametrize("size", [0, 15, 8193, -1])
def test_invalid_texture_sizes_are_rejected(size):
    with pytest.raises(InputError, match="--size"):
        rasterise(Mesh(np.eye(3), np.array([[0, 1, 2]], np.int32)), size)


def test_margins_copy_nearest_texel_up_to_margin_width():
    known = np.zeros((64, 64), bool)
    known[20:40, 10:30] = True
    image = np.where(known, np.arange(64)[:, None] * 100.0 + np.arange(64), 0.0)
    (out,), reached = dilated([image], known, 4)
    assert out[18, 15] == image[20, 15] and out[30, 33] == image[30, 29]
    assert out[17, 7] == 0 and not reached[15, 15]  # a corner 4.2 texels away, beyond the margin
    assert np.array_equal(out[known], image[known])
    assert reached[16, 15] and margin_of(2048) == 32


def test_margins_across_row_blocks(monkeypatch):
    from patina.core.maps import dilate

    rng = np.random.default_rng(0)
    known = rng.random((90, 50)) > 0.97
    image = np.where(known, rng.random((90, 50)), 0.0)
    (whole,), reached = dilated([image], known, 5)
    monkeypatch.setattr(dilate, "STRIP", 16)
    (parts,), again = dilated([image], known, 5)
    assert np.array_equal(reached, again)
    away = np.abs(whole - parts) > 0  # ties between equally near texels may be resolved either way
    assert away.mean() < 0.05
