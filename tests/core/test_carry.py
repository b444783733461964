"""Paint on photos goes to the faces that are seen there, and comes back as it was."""

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
    """At z = 4 · side, looking at the middle."""
    turn = np.diag([side, 1.0, -side]) * [[1], [-1], [1]]
    pose = Pose(turn, np.array([0, 0, 4.0]))
    return Camera("c", SIZE, SIZE, "PINHOLE", (220.0, 220.0, SIZE / 2, SIZE / 2), pose)


def _looks_at(camera: Camera) -> None:
    assert camera.project(np.zeros((1, 3)))[0] == pytest.approx([SIZE / 2, SIZE / 2])
    assert np.linalg.det(camera.pose.rotation) == pytest.approx(1)


@pytest.mark.parametrize("level", [2, 5])  # faces of many pixels, and many faces a pixel
def test_there_and_back(level: int) -> None:
    """Halves of a ball, as the mesh wears them, seen in a photo and carried back."""
    camera, mesh = _camera(), _ball(level)
    _looks_at(camera)
    rays = RayScene.build(mesh)
    seen = VisibleFaces.of(rays, camera)
    truth = (mesh.vertices[mesh.faces].mean(axis=1)[:, 0] > 0.1).astype(np.int32)
    image = seen.image(truth)
    assert set(np.unique(image)) == {NONE, 0, 1}
    nobody = np.full(len(truth), 7, np.int32)
    found = updated_labels(nobody, seen.votes(image, 2, len(truth)))
    met = found != 7
    assert (found[met] == truth[met]).mean() > (0.999 if level == 2 else 0.97)
    middle = mesh.vertices[mesh.faces].mean(axis=1)
    towards = camera.pose.centre - middle
    turned_here = np.einsum("fi,fi->f", middle, towards) > 0.15 * np.linalg.norm(towards, axis=1)
    assert met[turned_here].all()  # also those that no pixel's middle meets


def test_a_stroke_does_not_go_through_the_object() -> None:
    camera, mesh = _camera(), _ball(5)
    seen = VisibleFaces.of(RayScene.build(mesh), camera)
    everywhere = np.zeros((SIZE, SIZE), np.int32)
    found = updated_labels(
        np.full(len(mesh.faces), 3, np.int32), seen.votes(everywhere, 1, len(mesh.faces))
    )
    behind = mesh.vertices[mesh.faces].mean(axis=1)[:, 2] < 0
    assert (found[behind] == 3).all()
    assert (found == 0).sum() > 0.4 * len(found) * (1 - 1 / 4)


def test_what_is_not_painted_stays() -> None:
    camera, mesh = _camera(), _ball(4)
    rays = RayScene.build(mesh)
    seen = VisibleFaces.of(rays, camera)
    labels = np.arange(len(mesh.faces), dtype=np.int32) % 5
    stroke = np.full((SIZE, SIZE), NONE)
    stroke[:, : SIZE // 2] = 1
    found = updated_labels(labels, seen.votes(stroke, 2, len(labels)))
    view = view_surface(rays, camera)
    right = np.unique(view.face[view.pixel % SIZE >= SIZE // 2 + 3])
    left = np.unique(view.face[view.pixel % SIZE < SIZE // 2 - 3])
    right = np.setdiff1d(right, left)
    assert (found[right] == labels[right]).all()
    assert (found[left] == 1).mean() > 0.98


def test_photos_vote_together() -> None:
    """Two photos disagree about a face: what most of its pixels say is taken."""
    votes = np.array([[5, 3, 0], [3, 5, 1], [0, 0, 9], [2, 0, 3], [2, 0, 2]])
    assert updated_labels(np.full(5, 4), votes).tolist() == [0, 1, 4, 4, 0]


def test_photos_from_both_sides_meet_all_faces() -> None:
    mesh = _ball(5)
    rays = RayScene.build(mesh)
    votes = sum(
        VisibleFaces.of(rays, _camera(side)).votes(np.zeros((SIZE, SIZE), int), 1, len(mesh.faces))
        for side in (1.0, -1.0)
    )
    found = updated_labels(np.full(len(mesh.faces), 3), votes)
    level = np.abs(mesh.vertices[mesh.faces].mean(axis=1)[:, 2])
    assert (found[level > 0.35] == 0).all()
