"""A click on a photo in the list always looks through its camera."""

from __future__ import annotations

import bpy
from support import extension
from test_workflow import folder, make_capture_module


def test_lamp_shading_is_a_toggle() -> None:
    module = extension("scene.views.lamp_shading")
    screen = (
        bpy.context.window_manager.windows[0].screen
        if bpy.context.window_manager.windows
        else bpy.data.screens["Layout"]
    )
    area = next(a for a in screen.areas if a.type == "VIEW_3D")
    shading = area.spaces.active.shading
    shading.type = "SOLID"
    before = shading.use_scene_lights, shading.use_scene_world
    assert not module.lamp_shading(area)
    assert module.toggle_lamp_shading(screen, area)
    assert shading.type == "MATERIAL" and shading.use_scene_lights and shading.use_scene_world
    assert not module.toggle_lamp_shading(screen, area)
    assert shading.type == "SOLID"
    assert (shading.use_scene_lights, shading.use_scene_world) == before


def perspective() -> str:
    areas = bpy.context.window_manager.windows[0].screen.areas
    view = next(area for area in areas if area.type == "VIEW_3D").spaces.active
    return view.region_3d.view_perspective


def orbit() -> None:
    """Leave the camera view, as the middle mouse button does."""
    for area in bpy.context.window_manager.windows[0].screen.areas:
        if area.type == "VIEW_3D":
            area.spaces.active.region_3d.view_perspective = "PERSP"


def test_every_click_returns_to_the_camera() -> None:
    path = make_capture_module().make_capture(folder() / "ball", photos=2)
    assert bpy.ops.patina.import_capture(filepath=str(path)) == {"FINISHED"}
    scene = bpy.context.scene
    for index in (1, 1, 0):  # also the row that is active already
        orbit()
        scene.camera = None
        assert bpy.ops.patina.look_through_photo(index=index) == {"FINISHED"}
        photo = scene.patina_photos.photos[index]
        assert perspective() == "CAMERA" and scene.camera == photo.camera
        assert extension("scene.photos.photo_list").looked_at(scene) == photo


def test_photo_without_camera_is_an_error() -> None:
    path = make_capture_module().make_capture(folder() / "ball", photos=2)
    assert bpy.ops.patina.import_capture(filepath=str(path)) == {"FINISHED"}
    scene = bpy.context.scene
    bpy.data.objects.remove(scene.patina_photos.photos[1].camera)
    for index in (1, 7):
        try:
            bpy.ops.patina.look_through_photo(index=index)
        except RuntimeError as error:
            assert "import the capture again" in str(error)
        else:
            raise AssertionError("a photo without a camera was shown")
