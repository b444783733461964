"""The sidebar's stages show what is present and what to do next; the list of photos shows each
photo.
"""

from __future__ import annotations

import bpy
import numpy as np
from support import extension
from test_workflow import folder, make_capture_module


def two_from_one_place():
    """Four photos of four cameras, and a fifth from the first camera under the second light."""
    path = make_capture_module().make_capture(folder() / "ball", photos=4)
    text = path.read_text()
    camera, light = "lit_1.exr", text.split("[[photo]]")[2]
    more = light.replace('file = "lit_2.exr"', 'file = "again.exr"')
    first = next(li for li in text.split("[[photo]]")[1].splitlines() if li.startswith("camera"))
    more = "\n".join(first if li.startswith("camera") else li for li in more.splitlines())
    (path.parent / "again.exr").write_bytes((path.parent / camera).read_bytes())
    path.write_text(text.rstrip() + "\n\n[[photo]]\n" + more.strip() + "\n")
    return path


def test_stages_follow_progress() -> None:
    stages, scene = extension("scene.views.workflow_stages"), bpy.context.scene
    found = stages.stages(scene)
    assert list(found) == ["scan", "photos", "masks", "fit", "check", "material"]
    assert stages.next_stage(found) == "scan" and found["scan"].press == "patina.import_capture"
    path = make_capture_module().make_capture(
        folder() / "ball", photos=3, extra="[fit]\nheld_out = false"
    )
    bpy.ops.patina.import_capture(filepath=str(path))
    found = stages.stages(scene)
    assert found["scan"].done and found["photos"].has == ("3 lit photos, 3 lights",)
    assert stages.next_stage(found) == "fit", "masks are optional"
    bpy.ops.patina.shadow_masks()
    assert stages.stages(scene)["masks"].done
    bpy.ops.patina.fit()
    found = stages.stages(scene)
    assert found["fit"].done and found["material"].done
    assert stages.next_stage(found) == "check"
    for name, stage in found.items():
        assert stage.done or stage.missing, name
        if stage.press:
            group, operator = stage.press.split(".")
            assert hasattr(getattr(bpy.ops, group), operator)


def test_each_list_entry_shows_its_photo() -> None:
    """Two photos from one viewpoint: one camera, which shows the selected photo."""
    path = two_from_one_place()
    assert bpy.ops.patina.import_capture(filepath=str(path)) == {"FINISHED"}
    scene = bpy.context.scene
    state, listed = scene.patina_photos, extension("scene.photos.photo_list")
    assert [p.name for p in state.photos] == [*(f"lit_{k + 1}.exr" for k in range(4)), "again.exr"]
    first, last = state.photos[0], state.photos[4]
    assert first.camera == last.camera == scene.camera
    assert len(first.camera.data.background_images) == 1
    shown = first.camera.data.background_images[0]
    assert shown.image == first.image != last.image
    state.active = 4
    assert shown.image == last.image and scene.camera["patina_place"] == 4
    assert listed.looked_at(scene).name == "again.exr"
    lamps = [o for o in scene.objects if o.type == "LIGHT" and "patina_light" in o]
    on = [lamp["patina_light"] for lamp in lamps if not lamp.hide_render]
    assert on == [last.light] == [state.photos[1].light]
    bpy.ops.patina.next_photo()
    assert state.active == 0 and shown.image == first.image
    bpy.ops.patina.next_photo(step=-1)
    assert state.active == 4
    state.active = 2
    assert scene.camera == state.photos[2].camera

    state.mesh_over = 0.25
    behind = scene.camera.data.background_images[-1]
    assert (behind.display_depth, round(behind.alpha, 6)) == ("FRONT", 0.75)
    state.mesh_over = 1.0
    assert (behind.display_depth, behind.alpha) == ("BACK", 1.0)


def test_display_exposure_does_not_change_photo() -> None:
    bpy.ops.patina.import_capture(filepath=str(two_from_one_place()))
    state = bpy.context.scene.patina_photos
    first, last = state.photos[0], state.photos[4]
    shown = first.camera.data.background_images[0]

    def level(image: bpy.types.Image) -> np.ndarray:
        pixels = np.empty(len(image.pixels), np.float32)
        image.pixels.foreach_get(pixels)
        return pixels.reshape(image.size[1], image.size[0], 4)[..., :3]

    before = level(first.image)
    state.view_exposure = 1.0
    assert shown.image not in (first.image, last.image) and tuple(shown.image.size) == tuple(
        first.image.size
    )
    encoded = level(shown.image)
    linear = np.where(encoded <= 0.04045, encoded / 12.92, ((encoded + 0.055) / 1.055) ** 2.4)
    assert np.abs(linear - np.clip(2 * before, 0, 1)).max() < 0.01
    assert np.array_equal(level(first.image), before), "the photo itself was changed"
    state.active = 4
    assert shown.image != last.image, "the next photo is shown with the same exposure"
    state.view_exposure = 0.0
    assert shown.image == last.image
    assert len([i for i in bpy.data.images if "patina_exposed" in i]) == 1


def test_photo_list_is_saved_and_old_files_get_one() -> None:
    path, blend = (
        make_capture_module().make_capture(folder() / "ball", photos=3),
        folder() / "list.blend",
    )
    bpy.ops.patina.import_capture(filepath=str(path))
    bpy.context.scene.patina_photos.active = 1
    bpy.ops.wm.save_as_mainfile(filepath=str(blend))
    bpy.ops.wm.open_mainfile(filepath=str(blend))
    state = bpy.context.scene.patina_photos
    names = [(p.name, p.camera.name, p.image.name, p.light) for p in state.photos]
    assert len(names) == 3 and state.active == 1
    state.photos.clear()  # as saved by a version without the list
    bpy.ops.wm.save_as_mainfile(filepath=str(blend))
    bpy.ops.wm.open_mainfile(filepath=str(blend))
    state = bpy.context.scene.patina_photos
    assert [(p.name, p.camera.name, p.image.name, p.light) for p in state.photos] == names
    assert state.active == 1


def test_deleted_camera_is_skipped() -> None:
    path = make_capture_module().make_capture(folder() / "ball", photos=3)
    bpy.ops.patina.import_capture(filepath=str(path))
    scene, listed = bpy.context.scene, extension("scene.photos.photo_list")
    bpy.data.objects.remove(scene.patina_photos.photos[1].camera)
    assert [p.name for p in listed.lit_photos(scene)] == ["lit_1.exr", "lit_3.exr"]
    bpy.ops.patina.next_photo()
    assert listed.looked_at(scene).name == "lit_3.exr"
    scene.patina_photos.active = 1  # nothing to show
    assert listed.looked_at(scene) is None


def test_remaining_time_is_shown_rounded() -> None:
    state = extension("scene.session.running_job")
    for seconds, text in (
        (None, "x"),
        (3, "x, 5 s left"),
        (43, "x, 45 s left"),
        (200, "x, 3 min left"),
    ):
        assert state.Running("s", "fit", "x", 0.5, seconds).text == text


def test_measured_material_is_asset_with_provenance() -> None:
    path = make_capture_module().make_capture(folder() / "ball", photos=3)
    bpy.ops.patina.import_capture(filepath=str(path))
    assert not bpy.ops.patina.mark_assets.poll()
    bpy.ops.patina.fit()
    material = bpy.data.materials["surface"]
    width, height = material.preview.image_size
    pixels = np.array(material.preview.image_pixels_float[:]).reshape(height, width, 4)
    disc = pixels[..., 3] > 0.5
    assert abs(disc.mean() - np.pi / 4 / 1.05**2) < 0.01, "a sphere on a transparent background"
    red, green, blue, _ = pixels[disc].mean(axis=0)
    assert red > 1.3 * green and red > 1.3 * blue, "the preview has the ball's red colour"
    assert bpy.ops.patina.mark_assets() == {"FINISHED"}
    data = material.asset_data
    assert {"Patina", "measured", "surface", "ball"} == {tag.name for tag in data.tags}
    assert "3 lit photos" in data.description and "held-out photos" in data.description
    provenance = material["patina_provenance"]
    assert (
        provenance["date"].endswith(material["patina_date"])
        and "ball.capture.toml" in provenance["scan"]
    )
    bpy.ops.patina.mark_assets()  # again: the same
    assert len(data.tags) == 4
    blend = folder() / "asset.blend"
    bpy.ops.wm.save_as_mainfile(filepath=str(blend))
    bpy.ops.wm.open_mainfile(filepath=str(blend))
    again = bpy.data.materials["surface"]
    assert again.asset_data is not None and tuple(again.preview.image_size) == (width, height)
    kept = np.array(again.preview.image_pixels_float[:]).reshape(height, width, 4)
    np.testing.assert_allclose(kept, pixels, atol=1 / 255)
