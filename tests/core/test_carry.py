"""Labels painted on photos are transferred to the visible mesh faces and back."""

from __future__ import annotations

import numpy as np
import pytest
import trimesh

from patina.core.geometry import RayScene, view_surface
from patina.core.masks.carry import NONE, VisibleFaces, updated_labels
from patina.core.scan import Camera, Mesh, Pose

SIZE = 120


def _ball(level: int) -> Mesh:
    ball = trimesh.creation.icosphere(subdivisions=level)
    return Mesh(np.array(ball.vertices), np.array(ball.faces, np.int32))


def _camera(side: float = 1.0) -> Camera:
    """A camera at z = 4 · side that looks at the origin."""
    rotation = np.diag([side, 1.0, -side]) * [[1], [-1], [1]]
    pose = Pose(rotation, np.array([0, 0, 4.0]))
    return Camera("c", SIZE, SIZE, "PINHOLE", (220.0, 220.0, SIZE / 2, SIZE / 2), pose)


def _check_looks_at_origin(camera: Camera) -> None:
    assert camera.project(np.zeros((1, 3)))[0] == pytest.approx([SIZE / 2, SIZE / 2])
    assert np.linalg.det(camera.pose.rotation) == pytest.approx(1)


@pytest.mark.parametrize("level", [2, 5])  # faces larger than a pixel, and several faces per pixel
def test_labels_round_trip_through_a_photo(level: int) -> None:
    """The labels of two halves of a ball are rendered into a photo and transferred back."""
    camera, mesh = _camera(), _ball(level)
    _check_looks_at_origin(camera)
    rays = RayScene.build(mesh)
    visible = VisibleFaces.of(rays, camera)
    truth = (mesh.vertices[mesh.faces].mean(axis=1)[:, 0] > 0.1).astype(np.int32)
    image = visible.image(truth)
    assert set(np.unique(image)) == {NONE, 0, 1}
    initial_labels = np.full(len(truth), 7, np.int32)
    found = updated_labels(initial_labels, visible.votes(image, 2, len(truth)))
    updated = found != 7
    assert (found[updated] == truth[updated]).mean() > (0.999 if level == 2 else 0.97)
    face_centres = mesh.vertices[mesh.faces].mean(axis=1)
    to_camera = camera.pose.centre - face_centres
    faces_camera = np.einsum("fi,fi->f", face_centres, to_camera) > 0.15 * np.linalg.norm(
        to_camera, axis=1
    )
    assert updated[faces_camera].all()  # including faces that contain no pixel centre


def test_stroke_does_not_label_hidden_faces() -> None:
    camera, mesh = _camera(), _ball(5)
    visible = VisibleFaces.of(RayScene.build(mesh), camera)
    full_stroke = np.zeros((SIZE, SIZE), np.int32)
    found = updated_labels(
        np.full(len(mesh.faces), 3, np.int32), visible.votes(full_stroke, 1, len(mesh.faces))
    )
    back_side = mesh.vertices[mesh.faces].mean(axis=1)[:, 2] < 0
    assert (found[back_side] == 3).all()
    assert (found == 0).sum() > 0.4 * len(found) * (1 - 1 / 4)


def test_unpainted_faces_keep_their_labels() -> None:
    camera, mesh = _camera(), _ball(4)
    rays = RayScene.build(mesh)
    visible = VisibleFaces.of(rays, camera)
    labels = np.arange(len(mesh.faces), dtype=np.int32) % 5
    stroke = np.full((SIZE, SIZE), NONE)
    stroke[:, : SIZE // 2] = 1
    found = updated_labels(labels, visible.votes(stroke, 2, len(labels)))
    view = view_surface(rays, camera)
    right = np.unique(view.face[view.pixel % SIZE >= SIZE // 2 + 3])
    left = np.unique(view.face[view.pixel % SIZE < SIZE // 2 - 3])
    right = np.setdiff1d(right, left)
    assert (found[right] == labels[right]).all()
    assert (found[left] == 1).mean() > 0.98


def test_majority_of_pixel_votes_decides() -> None:
    """If photos disagree about a face, the majority of its pixels decides."""
    votes = np.array([[5, 3, 0], [3, 5, 1], [0, 0, 9], [2, 0, 3], [2, 0, 2]])
    assert updated_labels(np.full(5, 4), votes).tolist() == [0, 1, 4, 4, 0]


def test_photos_from_both_sides_label_all_faces() -> None:
    mesh = _ball(5)
    rays = RayScene.build(mesh)
    votes = sum(
        VisibleFaces.of(rays, _camera(side)).votes(np.zeros((SIZE, SIZE), int), 1, len(mesh.faces))
        for side in (1.0, -1.0)
    )
    found = updated_labels(np.full(len(mesh.faces), 3), votes)
    level = np.abs(mesh.vertices[mesh.faces].mean(axis=1)[:, 2])
    assert (found[level > 0.35] == 0).all()
