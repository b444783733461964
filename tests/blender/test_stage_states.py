"""A stage is done without doubt only where its data is known."""

from __future__ import annotations

import bpy
import numpy as np
from support import extension
from test_find_lights import guessed_capture


def stage(name: str):
    return extension("scene.views.workflow_stages").stages(bpy.context.scene)[name]


def knowledge(light: str) -> str:
    module = extension("scene.photos.lamp_knowledge")
    capture = extension("scene.session.scene_properties").capture_path(bpy.context.scene)
    return module.knowledge_of(bpy.context.scene, capture, light).sentence


def test_guessed_light_is_doubtful_until_it_is_found() -> None:
    path, _ = guessed_capture()
    bpy.ops.patina.import_capture(filepath=str(path))
    photos = stage("photos")
    assert photos.done and photos.doubts == ("Light lamp1 is a guess",)
    assert photos.remedy == "patina.find_lights"
    assert knowledge("lamp1") == "lamp1: a guess"
    assert knowledge("lamp2") == "lamp2: from the capture file"
    bpy.ops.patina.find_lights()
    bpy.context.view_layer.update()
    assert not stage("photos").doubts
    assert "found from photos, ±" in knowledge("lamp1")
    dragged = extension("scene.photos.dragged_lamps")
    capture = extension("scene.session.scene_properties").capture_path(bpy.context.scene)
    lamp = dragged.lamp_of(bpy.context.scene, capture, "lamp1")
    lamp.rotation_mode = "XYZ"
    lamp.rotation_euler[1] += 0.3
    bpy.context.view_layer.update()
    assert knowledge("lamp1") == "lamp1: placed by hand"
    bpy.data.objects.remove(lamp)
    assert knowledge("lamp1") == "lamp1: not in the scene"
    assert "No lamp in the scene for lamp1" in stage("photos").doubts[0]


def test_saved_capture_keeps_what_is_known() -> None:
    path, _ = guessed_capture()
    bpy.ops.patina.import_capture(filepath=str(path))
    bpy.ops.patina.find_lights()
    bpy.context.view_layer.update()
    bpy.ops.patina.save_lights(filepath=str(path), check_existing=False)
    assert "found from photos, ±" in knowledge("lamp1")
    collection = next(c for c in bpy.data.collections if c.get("patina_capture") == str(path))
    for thing in list(collection.all_objects):
        bpy.data.objects.remove(thing)
    bpy.data.collections.remove(collection)
    bpy.ops.patina.import_capture(filepath=str(path))
    assert "found from photos, ±" in knowledge("lamp1") and not stage("photos").doubts


def test_poor_fit_is_no_success() -> None:
    path, _ = guessed_capture()
    bpy.ops.patina.import_capture(filepath=str(path))
    properties = extension("scene.session.scene_properties")
    capture = properties.capture_path(bpy.context.scene)
    for typical, poor in ((0.05, False), (0.99, True)):
        material = {"name": "paint", "held_out": {"typical": typical}, "warnings": []}
        properties.store_result(capture, {"materials": [material]})
        fit = stage("fit")
        assert fit.done and bool(fit.doubts) == poor
    assert fit.doubts == ("Poor fit: paint",)


def test_passed_optional_stage_is_not_next() -> None:
    stages = extension("scene.views.workflow_stages")
    done, optional = stages.Stage(), stages.Stage(missing="No masks", optional=True)
    fitted = stages.Stage(press="patina.fit")
    needed = stages.Stage(missing="Not measured yet", press="patina.fit")
    assert stages.next_stage({"masks": optional, "fit": needed, "check": optional}) == "fit"
    assert stages.next_stage({"masks": optional, "fit": fitted, "check": optional}) == "check"
    assert stages.next_stage({"masks": optional, "fit": fitted, "check": done}) is None


def outdated(kind: str = "Patina result") -> tuple[str, ...]:
    return extension("scene.views.outdated").changes_since(bpy.context.scene, kind)


def stored_fit() -> None:
    """A stored result of the open capture, with the present inputs."""
    properties = extension("scene.session.scene_properties")
    capture = properties.capture_path(bpy.context.scene)
    properties.store_result(capture, {"materials": [{"name": "paint", "held_out": None}]})
    extension("scene.views.outdated").record_inputs(bpy.context.scene)


def test_edits_after_a_fit_make_it_outdated() -> None:
    path, _ = guessed_capture()
    bpy.ops.patina.import_capture(filepath=str(path))
    scene, mesh = bpy.context.scene, bpy.context.scene.patina.mesh
    stored_fit()
    assert not outdated()
    mesh.scale = (2.0, 2.0, 2.0)
    bpy.context.view_layer.update()
    assert outdated() == ("the mesh was scaled",)
    bpy.context.view_layer.objects.active = mesh
    bpy.ops.object.transform_apply(scale=True)
    bpy.context.view_layer.update()
    assert "the mesh was edited" in outdated() and "the mesh was scaled" not in outdated()
    assert stage("fit").doubts[0].startswith("Outdated: the mesh was edited")
    stored_fit()
    assert not outdated()
    mesh.data.polygons[0].material_index = 3
    mesh.data.update()
    bpy.context.view_layer.update()
    assert outdated() == ("materials of the mesh were painted or changed",)
    stored_fit()
    path.write_text(path.read_text() + "# changed\n")
    assert outdated() == ("the capture file was changed",)
    stored_fit()
    dragged = extension("scene.photos.dragged_lamps")
    capture = extension("scene.session.scene_properties").capture_path(scene)
    bpy.data.objects.remove(dragged.lamp_of(scene, capture, "lamp1"))  # as it was imported
    assert outdated() == ("a lamp was moved or deleted",)
    stored_fit()
    lamp = dragged.lamp_of(scene, capture, "lamp2")
    lamp.rotation_mode = "XYZ"
    lamp.rotation_euler[0] += 0.1
    bpy.context.view_layer.update()
    assert outdated() == ("a lamp was moved or deleted",)
    stored_fit()
    bpy.data.objects.remove(lamp)
    assert outdated() == ("a lamp was moved or deleted",)


def test_painting_a_mask_makes_a_fit_outdated() -> None:
    path, _ = guessed_capture()
    bpy.ops.patina.import_capture(filepath=str(path))
    masks = extension("scene.paint.mask_images")
    capture = extension("scene.session.scene_properties").capture_path(bpy.context.scene)
    grey = np.zeros((90, 120), np.uint8)
    image = masks.store_mask(capture, 0, "lit_1.exr", "ignore", grey)
    stored_fit()
    assert not outdated()
    image.pixels[400] = 1.0  # as a brush in the Image Editor does
    image.update()
    assert image.is_dirty and outdated() == ("masks were painted, added or removed",)
    assert stage("fit").outdated
    masks.with_mask_images(extension("core.capture").read_capture(path))  # as a fit does
    stored_fit()
    assert not image.is_dirty and not outdated()
    grey[20:40, 30:60] = 255
    masks.store_mask(capture, 0, "lit_1.exr", "ignore", grey)
    assert outdated() == ("masks were painted, added or removed",)


def test_turning_the_whole_scan_is_no_change() -> None:
    path, _ = guessed_capture()
    bpy.ops.patina.import_capture(filepath=str(path))
    stored_fit()
    bpy.context.scene.patina_orientation.up_axis = "X"
    bpy.context.view_layer.update()
    assert not outdated()


def test_saved_file_keeps_inputs_of_the_fit() -> None:
    path, _ = guessed_capture()
    bpy.ops.patina.import_capture(filepath=str(path))
    stored_fit()
    saved = path.parent / "scene.blend"
    bpy.ops.wm.save_as_mainfile(filepath=str(saved))
    bpy.ops.wm.open_mainfile(filepath=str(saved))
    bpy.context.view_layer.update()
    assert not outdated()
    bpy.context.scene.patina.mesh.data.vertices[0].co.x += 0.1
    bpy.context.scene.patina.mesh.data.update()
    bpy.context.view_layer.update()
    assert outdated() == ("the mesh was edited",)


def test_removed_material_gives_its_faces_to_the_first() -> None:
    path, _ = guessed_capture()
    bpy.ops.patina.import_capture(filepath=str(path))
    scene, mesh = bpy.context.scene, bpy.context.scene.patina.mesh
    for name in ("clay", "gold"):  # the rest of the object is the first material
        bpy.ops.patina.add_material(name=name)
    kinds = extension("scene.paint.paint_kinds")
    slots = kinds.slots_of_faces(mesh)
    slots[:] = 0
    slots[10:20], slots[20:40] = 1, 2
    kinds.assign_slots(mesh, slots)
    scene.patina_paint.active = 1
    assert bpy.ops.patina.remove_material() == {"FINISHED"}
    names = [paint.name for paint in kinds.paints(scene)[:2]]
    assert names == ["surface", "gold"], names
    now = kinds.slots_of_faces(mesh)
    assert (now[:20] == 0).all() and (now[20:40] == 1).all()
    bpy.ops.patina.remove_material()
    bpy.ops.patina.remove_material()
    assert not scene.patina.use_slots and not len(mesh.data.materials)
