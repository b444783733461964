"""A new capture from loose files: recognised, edited, created, without losing anything."""

from __future__ import annotations

from pathlib import Path

import bpy
import mathutils
import numpy as np
from support import extension
from test_workflow import counts, folder, make_capture_module


def loose_files(rename: bool = False) -> Path:
    """A folder with cameras, mesh and lit photos, without a capture file. rename: the photos'
    names do not match the cameras'."""
    path = make_capture_module().make_capture(folder() / "ball", photos=6)
    path.unlink()
    lit = path.parent / "lit"
    lit.mkdir()
    for k in range(1, 7):
        name = f"shot_{'abcdef'[k - 1]}.exr" if rename else f"view_{k:02d}.exr"
        (path.parent / f"lit_{k}.exr").rename(lit / name)
    return path.parent


def add(path: Path) -> None:
    assert bpy.ops.patina.add_files(directory=str(path)) == {"FINISHED"}


def test_folder_becomes_capture() -> None:
    scan, before = loose_files(), counts()
    add(scan)
    state = bpy.context.scene.patina_draft
    assert state.is_open and counts() == before
    assert Path(state.cameras).name == "sparse" and Path(state.mesh).name == "mesh.ply"
    assert [photo.camera for photo in state.photos] == [f"view_0{k}.jpg" for k in range(1, 7)]
    assert "6 photos" in state.found and "fits the cameras" in state.found
    assert bpy.ops.patina.create_capture() == {"FINISHED"}
    assert not state.is_open
    capture = extension("core.capture").read_capture(
        Path(extension("scene.session.scene_properties").capture_path(bpy.context.scene))
    )
    assert len(capture.photos) == 6
    assert all(light.guess for light in capture.lights)
    assert len({photo.light for photo in capture.photos}) == len(capture.lights)


def test_files_in_any_order_and_nothing_is_lost() -> None:
    scan = loose_files()
    assert bpy.ops.patina.add_files(directory=str(scan / "lit")) == {"FINISHED"}
    state = bpy.context.scene.patina_draft
    assert len(state.photos) == 6
    assert not bpy.ops.patina.create_capture.poll()
    (scan / "broken.ply").write_bytes(b"ply\nnot a mesh")
    bpy.ops.patina.add_files(directory=str(scan), files=[{"name": "broken.ply"}])
    assert len(state.photos) == 6 and "broken.ply" in state.problems and not state.mesh
    bpy.ops.patina.add_files(directory=str(scan), files=[{"name": "mesh.ply"}])
    add(scan / "sparse")
    assert all(photo.camera for photo in state.photos)
    assert bpy.ops.patina.create_capture.poll()
    assert bpy.ops.patina.cancel_draft() == {"FINISHED"}
    assert not state.is_open and not len(state.photos)
    assert not list(scan.glob("*.capture.toml"))


def test_lamps_are_grouped_by_hand() -> None:
    add(loose_files())
    state = bpy.context.scene.patina_draft
    bpy.ops.patina.draft_lamps(way="ONE")
    assert [lamp.name for lamp in state.lamps] == ["lamp 1"]
    bpy.ops.patina.draft_lamps(way="EACH")
    assert len(state.lamps) == 6 and len({photo.lamp for photo in state.photos}) == 6
    bpy.ops.patina.draft_lamps(way="ONE")
    state.active_photo = 2
    bpy.ops.patina.draft_lamps(way="ADD")
    assert [photo.lamp for photo in state.photos].count("lamp 2") == 1
    state.lamps["lamp 1"].kind = "flash"
    assert not bpy.ops.patina.create_capture.poll()  # a distant lamp has no common scale with it
    near = state.lamps["lamp 2"]
    near.kind, near.values, near.stated = "near", (0.0, 3.0, 4.0), True
    assert bpy.ops.patina.create_capture() == {"FINISHED"}
    capture = extension("core.capture").read_capture(
        Path(extension("scene.session.scene_properties").capture_path(bpy.context.scene))
    )
    flash, lamp = capture.lights
    assert flash.mounted is not None and flash.guess
    assert lamp.position is not None and not lamp.guess


def test_what_encloses_the_scan_is_hidden_and_undo_restores_it() -> None:
    bpy.ops.mesh.primitive_cube_add(size=20)
    cube = bpy.context.object
    path = make_capture_module().make_capture(folder() / "ball", photos=2)
    assert bpy.ops.patina.import_capture(filepath=str(path)) == {"FINISHED"}
    assert cube.hide_get() and cube.hide_render
    assert not bpy.context.scene.patina.mesh.hide_get()


def test_what_is_in_the_way_of_the_scan_is_hidden() -> None:
    """A cube inside the scan, one around a camera and one before another, and a table beside them,
    which stays."""
    path = make_capture_module().make_capture(folder() / "ball", photos=2)
    assert bpy.ops.patina.import_capture(filepath=str(path)) == {"FINISHED"}
    scene, mesh = bpy.context.scene, bpy.context.scene.patina.mesh
    cameras = [photo.camera for photo in scene.patina_photos.photos]
    size = max(mesh.dimensions)
    corner = mesh.matrix_world @ mathutils.Vector(mesh.bound_box[0])
    centre = mesh.matrix_world @ (
        sum((mathutils.Vector(c) for c in mesh.bound_box), mathutils.Vector()) / 8
    )
    offsets = np.array([camera.matrix_world.translation - centre for camera in cameras])
    axis = np.cross(offsets[0], offsets[1]) / np.linalg.norm(np.cross(offsets[0], offsets[1]))
    things = {}
    for name, place, edge in (
        ("inside", corner + mathutils.Vector((0.3, 0.3, 0.3)) * size, 0.2 * size),
        ("around a camera", cameras[0].matrix_world.translation, 0.1 * size),
        ("before a camera", 0.6 * cameras[1].matrix_world.translation + 0.4 * centre, 0.1 * size),
        ("table", centre + mathutils.Vector(axis) * 2 * size, size),
    ):
        bpy.ops.mesh.primitive_cube_add(size=edge, location=place)
        things[name] = bpy.context.object
    bpy.context.view_layer.update()
    hide = extension("scene.scan.objects_in_the_way").hide_in_the_way
    hidden = hide(scene, mesh, cameras)
    assert set(hidden) == {things[n].name for n in things if n != "table"}
    assert not things["table"].hide_get()


def test_menu_entries_are_removed() -> None:
    module = extension("operators.menus")
    drawn = bpy.types.TOPBAR_MT_file_import._dyn_ui_initialize()
    assert module._draw in drawn
    extension().unregister()
    try:
        assert module._draw not in bpy.types.TOPBAR_MT_file_import._dyn_ui_initialize()
    finally:
        extension().register()


def test_panel_shows_draft() -> None:
    add(loose_files())
    box = extension("panels.draft_box")

    class Layout:
        def __init__(self) -> None:
            self.seen: list[str] = []

        def __getattr__(self, name: str):
            def call(*arguments, **settings):
                self.seen.append(settings.get("text") or (arguments[0] if arguments else name))
                return self

            return call

    layout = Layout()
    box.draw_draft(layout, bpy.context.scene)
    assert "patina.create_capture" in layout.seen
    assert any(
        "fits the cameras" in str(line) or "The mesh fits" in str(line) for line in layout.seen
    )
