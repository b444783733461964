"""Orthographic cameras, and photos that are scaled copies of calibrated ones, in Blender."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

pytest.importorskip("bpy")
pytestmark = pytest.mark.blender

import bpy  # noqa: E402
from bpy_extras.object_utils import world_to_camera_view  # noqa: E402
from mathutils import Vector  # noqa: E402

from patina.core.scan.camera import Camera, Pose  # noqa: E402
from patina.scene.photos import cameras  # noqa: E402
from tests.make_capture import look_at, write_exr  # noqa: E402
from tests.wheel import cycles_sphere  # noqa: E402

# (pixels per unit, cx, cy, width, height): centred, off centre, portrait, outside the frame
LENSES = [
    (200.0, 256.0, 306.0, 512, 612),
    (310.0, 431.7, 388.2, 1000, 700),
    (95.5, 300.3, 610.9, 700, 1000),
    (400.0, -80.0, 900.0, 1200, 800),
]


def _camera(scale: float, cx: float, cy: float, width: int, height: int, y: float = 1.0) -> Camera:
    rotation, translation = look_at(np.array([1.9, -2.2, 1.4]), np.array([0.1, 0.2, -0.1]))
    return Camera("o", width, height, "ORTHOGRAPHIC", (scale, y * scale, cx, cy),
                  Pose(rotation, translation))  # fmt: skip


@pytest.mark.parametrize("lens", LENSES)
def test_blender_pixels_match_core_projection(lens: tuple) -> None:
    bpy.ops.wm.read_homefile(use_factory_startup=True)
    scene, camera = bpy.context.scene, _camera(*lens)
    stood = cameras.create_camera(camera, np.zeros(3), 3.0, scene.collection)
    cameras.look_through(scene, stood)
    bpy.context.view_layer.update()
    assert stood.data.type == "ORTHO"
    size = np.array([camera.width, camera.height])
    rng = np.random.default_rng(0)
    pixels = rng.uniform((0, 0), size, (400, 2))
    pixels[:4] = [(0, 0), (size[0], 0), (0, size[1]), size]
    depth = rng.uniform(2, 9, (400, 1))
    points = camera.ray_starts(pixels) + depth * camera.rays(pixels)
    assert np.abs(camera.project(points) - pixels).max() < 1e-9
    # Blender's own projection matrix, applied in double precision
    graph = bpy.context.evaluated_depsgraph_get()
    matrix = np.array(stood.calc_matrix_camera(graph, x=camera.width, y=camera.height))
    matrix = matrix @ np.linalg.inv(np.array(stood.matrix_world))
    clip = np.c_[points, np.ones(400)] @ matrix.T
    here = (clip[:, :2] / clip[:, 3:] * (1, -1) + 1) / 2 * size
    print(f"largest difference {np.abs(here - pixels).max():.6f} px")
    assert np.abs(here - pixels).max() < 0.001
    assert (np.abs(clip[:, 2] / clip[:, 3]) < 1).all()  # not clipped away
    view = world_to_camera_view(scene, stood, Vector(points[7]))
    assert np.allclose((view.x * size[0], (1 - view.y) * size[1]), pixels[7], atol=0.01)


def test_non_square_pixels_become_square() -> None:
    """The photo is resampled to Blender's camera."""
    bpy.ops.wm.read_homefile(use_factory_startup=True)
    scene, camera = bpy.context.scene, _camera(310.0, 431.7, 388.2, 1000, 700, y=1.02)
    assert not camera.pinhole
    square = camera.rectified()
    assert square.orthographic and square.pinhole
    stood = cameras.create_camera(camera, np.zeros(3), 3.0, scene.collection)
    assert np.isclose(stood.data.ortho_scale, 1000 / square.lens.focal_length_x)


def test_cycles_renders_point_at_its_pixel(tmp_path: Path) -> None:
    """A small ball, rendered off centre: the centre of its image is where core projects it."""
    ball = cycles_sphere.new_scene(size=64)
    scene = bpy.context.scene
    cycles_sphere.sky(1.0)
    camera = _camera(40.0, 90.0, 35.0, 150, 100)
    stood = cameras.create_camera(camera, np.zeros(3), 3.0, scene.collection)
    cameras.look_through(scene, stood)
    scene.cycles.filter_width, scene.cycles.samples = 1.0, 16
    middle = (camera.ray_starts(np.array([[51.3, 62.8]])) + 4 * camera.rays(np.zeros((1, 2))))[0]
    ball.location, ball.scale = middle.tolist(), (0.4, 0.4, 0.4)
    scene.world.cycles_visibility.camera = False
    image = cycles_sphere.render(tmp_path)[..., 0]
    rows, columns = np.indices(image.shape) + 0.5
    weight = image / image.sum()
    found = np.array([(weight * columns).sum(), (weight * rows).sum()])
    print("centroid", found)
    assert np.abs(found - (51.3, 62.8)).max() < 0.05


@pytest.mark.parametrize("model", ["ORTHOGRAPHIC", "SIMPLE_PINHOLE"])
def test_scaled_photo_fills_camera_frame(model: str, tmp_path: Path) -> None:
    """For a camera calibrated at four times the photo's size, each pixel lies at its own place."""
    bpy.ops.wm.read_homefile(use_factory_startup=True)
    scene = bpy.context.scene
    calibrated = _camera(400.0, 431.7, 388.2, 1000, 700)
    if model != "ORTHOGRAPHIC":
        calibrated = Camera("p", 1000, 700, model, (900.0, 431.7, 388.2), calibrated.pose)
    small = calibrated.resized(250, 175)
    write_exr(tmp_path / "small.exr", np.zeros((175, 250, 3)))
    stood = cameras.create_camera(calibrated, np.zeros(3), 3.0, scene.collection)
    cameras.put_photo_behind(stood, tmp_path / "small.exr")
    cameras.look_through(scene, stood)
    bpy.context.view_layer.update()
    background = stood.data.background_images[0]
    assert background.frame_method == "CROP" and background.scale == 1.0
    assert tuple(background.image.size) == (250, 175)
    # CROP fills the frame: the same aspect, so the photo's edges are the frame's
    size = np.array([scene.render.resolution_x, scene.render.resolution_y])
    assert np.allclose(size[0] / size[1], 250 / 175)
    twin = cameras.create_camera(small, np.zeros(3), 3.0, scene.collection)
    for key in ("lens", "ortho_scale", "shift_x", "shift_y", "sensor_width"):
        assert np.isclose(getattr(twin.data, key), getattr(stood.data, key), rtol=1e-6), key
