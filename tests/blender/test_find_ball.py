"""The direction of a lamp from a ball in a photo, with an outline that can be moved."""

from __future__ import annotations

import bpy
import numpy as np
from support import extension
from test_workflow import folder, make_capture_module

RADIUS = 0.5  # of the ball
PHOTO = 1


def capture_with_ball():
    """An imported capture whose second photo shows a ball; its lamp was turned away."""
    made = make_capture_module()
    path = made.make_capture(folder() / "ball")
    made.write_ball_photo(path.parent / f"lit_{PHOTO + 1}.exr", PHOTO, RADIUS)
    assert bpy.ops.patina.import_capture(filepath=str(path)) == {"FINISHED"}
    scene = bpy.context.scene
    scene.patina_photos.active = PHOTO
    capture = extension("scene.session.scene_properties").capture_path(scene)
    lamp = extension("scene.photos.dragged_lamps").lamp_of(scene, capture, f"lamp{PHOTO + 1}")
    lamp.rotation_mode = "XYZ"
    lamp.rotation_euler = (0.3, 0.4, 0.5)
    bpy.context.view_layer.update()
    return path, list(made.light_directions())[PHOTO]


def direction(path) -> np.ndarray:
    """The direction that a fit would use."""
    bpy.context.view_layer.update()
    capture = extension("core.capture").read_capture(path)
    lamps = extension("scene.photos.dragged_lamps")
    now, _ = lamps.with_dragged_lamps(capture, bpy.context.scene)
    return now.lights[PHOTO].direction


def degrees(one: np.ndarray, other: np.ndarray) -> float:
    return float(np.degrees(np.arccos(min(float(one @ other), 1.0))))


def test_lamp_moves_to_the_direction_of_the_highlight() -> None:
    path, true = capture_with_ball()
    assert degrees(direction(path), true) > 20
    assert bpy.ops.patina.find_ball(surface="glossy") == {"FINISHED"}
    assert degrees(direction(path), true) < 2.0
    known = extension("scene.photos.lamp_knowledge").knowledge_of(
        bpy.context.scene, str(path.resolve()), f"lamp{PHOTO + 1}"
    )
    assert known.source.name == "FOUND" and known.error is not None


def test_outline_is_an_object_that_can_be_corrected() -> None:
    path, true = capture_with_ball()
    scene = bpy.context.scene
    bpy.ops.patina.find_ball(surface="glossy")
    ball = bpy.context.view_layer.objects.active
    assert ball.name.startswith("Ball") and not ball.hide_get()
    place, size = np.array(ball.location), ball.scale[0]
    ball.location.x += 0.06 * size  # somewhat beside and too large
    ball.scale = [1.06 * size] * 3
    bpy.context.view_layer.update()
    assert bpy.ops.patina.find_ball(surface="glossy") == {"FINISHED"}
    assert degrees(direction(path), true) < 2.0
    assert np.abs(np.array(ball.location) - place).max() < 0.02 * size  # found again
    assert len([o for o in scene.objects if o.name.startswith("Ball")]) == 1
    scene.patina_photos.active = 0
    assert ball.hide_get()
    scene.patina_photos.active = PHOTO
    assert not ball.hide_get()


def test_photo_without_ball_gets_a_circle_to_move() -> None:
    path, _ = capture_with_ball()
    grey = np.full((90, 120, 3), 0.2)
    make_capture_module().write_exr(path.parent / f"lit_{PHOTO + 1}.exr", grey)
    before = direction(path)
    assert bpy.ops.patina.find_ball() == {"FINISHED"}
    assert bpy.context.view_layer.objects.active.name.startswith("Ball")
    assert np.allclose(direction(path), before)


def test_flash_has_no_ball() -> None:
    path, _ = capture_with_ball()
    flash = extension("scene.photos.dragged_lamps").lamp_of(
        bpy.context.scene, str(path.resolve()), f"lamp{PHOTO + 1}"
    )
    flash["patina_kind"] = "mounted"
    assert not bpy.ops.patina.find_ball.poll()
