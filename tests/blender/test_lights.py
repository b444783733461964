"""Lamps as a user handles them: stepped through, dragged, undone, fitted with, saved."""

from __future__ import annotations

import json
from pathlib import Path

import bpy
import numpy as np
from support import extension
from test_workflow import folder, make_capture_module

PLACE = np.array([1.9, 0.4, 2.6])  # true position of the lamp
INTENSITY = 20.0


def lit_by_a_lamp(offset: tuple[float, float, float] = (0.0, 0.0, 0.0), photos: int = 3) -> Path:
    """A capture whose photos were lit by a near lamp (a flash in the last one); its file states a
    lamp position that is wrong by ``offset``.
    """
    as_in_its_files()
    path = make_capture_module().make_capture(
        folder() / "ball", photos=photos, extra="[fit]\nheld_out = false\ntrials = 1"
    )
    for i, (rotation, translation) in enumerate(make_capture_module().poses(photos), start=1):
        at = PLACE
        if i == photos:
            at = rotation.T @ (np.array([0.4, -0.3, 0.0]) - translation)
        towards = at / np.linalg.norm(at)
        image = make_capture_module().photo(rotation, translation, towards, lamp=(at, INTENSITY))
        make_capture_module().write_exr(path.parent / f"lit_{i}.exr", image)
    head, tail = path.read_text().split("[[light]]", 1)
    x, y, z = (float(a) for a in np.add(PLACE, offset))
    lights = f"""# where the lamp was, roughly
[[light]]
name = "lamp"
position = [{x}, {y}, {z}]  # by eye
intensity = [20.0, 20.0, 20.0]

[[light]]
name = "flash"
mounted = [0.4, -0.3, 0.0]
intensity = [20.0, 20.0, 20.0]

"""
    tail = tail[tail.index("[[photo]]") :].replace(f'"lamp{photos}"', '"flash"')
    for i in range(1, photos):
        tail = tail.replace(f'"lamp{i}"', '"lamp"')
    path.write_text(head + lights + tail)
    return path


def as_in_its_files() -> None:
    """Do not turn the scans of this scene: positions are compared with those of the files."""
    bpy.context.scene.patina_orientation.up_axis = "Z"


def lamp(name: str) -> bpy.types.Object:
    objects = bpy.context.scene.objects
    return next(o for o in objects if o.type == "LIGHT" and o.get("patina_light") == name)


def test_flash_moves_with_camera() -> None:
    path = lit_by_a_lamp()
    assert bpy.ops.patina.import_capture(filepath=str(path)) == {"FINISHED"}
    scene = bpy.context.scene
    for _ in range(7):
        bpy.ops.patina.next_photo()
        bpy.context.view_layer.update()
        shining = [o for o in scene.objects if o.type == "LIGHT" and "patina_light" in o
                   and not o.hide_render]  # fmt: skip
        assert [o["patina_light"] for o in shining] == [scene.camera["patina_light"]]
        if scene.camera["patina_light"] == "flash":
            seen = scene.camera.matrix_world.inverted() @ shining[0].matrix_world.translation
            assert np.allclose(seen, (0.4, 0.3, 0.0), atol=1e-5)
        else:
            assert np.allclose(shining[0].matrix_world.translation, PLACE, atol=1e-5)


def test_fit_uses_dragged_lamp() -> None:
    """An undone drag is not used."""
    path = lit_by_a_lamp((0.9, -0.8, 0.5))
    bpy.ops.patina.import_capture(filepath=str(path))
    bpy.ops.ed.undo_push(message="before the drag")
    lamp("lamp").location = PLACE.tolist()
    bpy.ops.ed.undo_push(message="drag")
    bpy.ops.patina.fit()
    stored_lights = json.loads(bpy.data.texts["Patina result"].as_string())["lights"]
    assert [light["name"] for light in stored_lights] == ["lamp", "flash"]
    assert np.allclose(stored_lights[0]["position"], PLACE, atol=1e-6)
    assert stored_lights[1]["offset"] == [0.4, -0.3, 0.0]
    bpy.ops.ed.undo()
    assert not np.allclose(lamp("lamp").location, PLACE)
    capture = extension("core.capture").read_capture(path)
    now, names = extension("scene.photos.dragged_lamps").with_dragged_lamps(
        capture, bpy.context.scene
    )
    assert names == [] and now.lights[0] is capture.lights[0]


def test_lights_are_saved_and_restored() -> None:
    path = lit_by_a_lamp((0.9, -0.8, 0.5))
    bpy.ops.patina.import_capture(filepath=str(path))
    lamp("lamp").location = PLACE.tolist()
    lamp("flash").location = (0.1, 0.2, 0.3)
    before = path.read_text()
    out = path.with_name("mine.capture.toml")
    assert bpy.ops.patina.save_lights(filepath=str(out)) == {"FINISHED"}
    assert path.read_text() == before
    text = out.read_text()
    assert text.startswith("[scan]") and "# by eye" in text and "# where the lamp was" in text
    saved = extension("core.capture").read_capture(out).lights
    assert np.allclose(saved[0].position, PLACE, atol=1e-6)
    assert np.allclose(saved[1].mounted, (0.1, -0.2, -0.3), atol=1e-6)
    try:
        bpy.ops.patina.save_lights(filepath=str(out))
    except RuntimeError as error:
        assert "the file exists already" in str(error)
    else:
        raise AssertionError("a file was overwritten without consent")
    bpy.ops.patina.save_lights(filepath=str(path), check_existing=False)  # into its own file
    assert "# by eye" in path.read_text()
    reader, moved = extension("core.capture").read_capture, extension("scene.photos.dragged_lamps")
    assert moved.with_dragged_lamps(reader(path), bpy.context.scene)[1] == []
    for _ in range(3):
        bpy.ops.patina.next_photo()
    assert moved.with_dragged_lamps(reader(path), bpy.context.scene)[1] == []
    bpy.ops.wm.read_homefile(use_factory_startup=True)
    as_in_its_files()
    bpy.ops.patina.import_capture(filepath=str(out))
    assert np.allclose(lamp("lamp").location, PLACE, atol=1e-6)


def test_lamp_without_power_is_one_message() -> None:
    bpy.ops.patina.import_capture(filepath=str(lit_by_a_lamp()))
    lamp("lamp").data.energy = 0.0
    try:
        bpy.ops.patina.fit()
    except RuntimeError as error:
        assert "emits no light" in str(error) and "Traceback" not in str(error)
    else:
        raise AssertionError("a lamp without power was accepted")


class LayoutRecorder:
    """Records what a panel draws."""

    def __init__(self) -> None:
        self.lines: list[str] = []

    def column(self, align: bool = False) -> LayoutRecorder:
        return self

    def label(self, text: str = "", icon: str = "NONE") -> None:
        icons = bpy.types.UILayout.bl_rna.functions["label"].parameters["icon"].enum_items
        assert icon in icons, icon
        self.lines.append(text)

    def operator(self, name: str, icon: str = "NONE") -> None:
        group, _, function = name.partition(".")
        assert getattr(getattr(bpy.ops, group), function).get_rna_type()
        self.lines.append(name)


def test_panel_lists_manual_changes() -> None:
    path = lit_by_a_lamp()
    bpy.ops.patina.import_capture(filepath=str(path))
    scene, box = bpy.context.scene, extension("panels.lamp_box")

    def drawn() -> list[str]:
        lines = LayoutRecorder()
        box.draw_lamp(lines, scene, scene.camera)
        return lines.lines

    assert drawn() == ["Near Lamp: lamp"]
    lamp("lamp").location.x += 1
    lamp("lamp").data.energy *= 2
    assert drawn() == ["Near Lamp: lamp", "Position, strength edited", "patina.save_lights"]
    bpy.ops.patina.next_photo(step=-1)
    assert drawn() == ["Flash: flash"]
    lights = [
        {"name": "flash", "refined": {"right": {"value": 0.4321, "standard_error": None},
                                      "1/beam²": {"value": 0.0, "standard_error": 0.1}}},
        {"name": "lamp", "refined": {}},
    ]  # fmt: skip
    extension("scene.session.scene_properties").store_result(
        scene.camera["patina_capture"], {"lights": lights}
    )
    assert drawn() == ["Flash: flash", "Refined: right 0.432 scan units"]
    bpy.data.objects.remove(lamp("flash"))
    assert drawn() == ["flash: the lamp is not in the scene"]
