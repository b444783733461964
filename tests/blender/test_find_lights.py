"""Lights found from the photos move their lamps, are fitted with and are saved."""

from __future__ import annotations

from pathlib import Path

import bpy
import numpy as np
from support import extension
from test_workflow import folder, make_capture_module


def guessed_capture() -> tuple[Path, np.ndarray]:
    """A capture whose first light is a guess; its true direction."""
    path = make_capture_module().make_capture(
        folder() / "ball", photos=3, extra="[fit]\nheld_out = false\ntrials = 1"
    )
    read = extension("core.capture").read_capture
    true = read(path).lights[0].direction
    text = path.read_text()
    line = next(line for line in text.splitlines() if line.startswith("direction"))
    path.write_text(text.replace(line, "direction = [1.0, 0.0, 0.0]\nguess = true", 1))
    return path, true


def degrees(one: np.ndarray, other: np.ndarray) -> float:
    return float(np.degrees(np.arccos(np.clip(one @ other, -1, 1))))


def test_guessed_lamp_is_found_and_saved() -> None:
    path, true = guessed_capture()
    assert bpy.ops.patina.import_capture(filepath=str(path)) == {"FINISHED"}
    scene = bpy.context.scene
    assert bpy.ops.patina.find_lights() == {"FINISHED"}
    bpy.context.view_layer.update()
    read = extension("core.capture").read_capture
    dragged = extension("scene.photos.dragged_lamps")
    capture, names = dragged.with_dragged_lamps(read(path), scene)
    found = capture.lights[0]
    assert names == [found.name]
    assert not found.guess
    assert 0 < np.degrees(found.standard_error) < 5
    assert degrees(found.direction, true) < 2 * np.degrees(found.standard_error)
    out = path.parent / "found.capture.toml"
    assert bpy.ops.patina.save_lights(filepath=str(out)) == {"FINISHED"}
    saved = read(out).lights[0]
    assert saved.standard_error is not None and not saved.guess
    lamp = dragged.lamp_of(scene, str(path), found.name)
    lamp.rotation_mode = "XYZ"
    lamp.rotation_euler[0] += 0.2
    bpy.context.view_layer.update()
    by_hand = dragged.with_dragged_lamps(read(path), scene)[0].lights[0]
    assert by_hand.standard_error is None and not by_hand.guess


def test_lamp_of_turned_scan_is_found() -> None:
    path, true = guessed_capture()
    assert bpy.ops.patina.import_capture(filepath=str(path)) == {"FINISHED"}
    scene = bpy.context.scene
    scene.patina.mesh.rotation_euler = (0.3, 0.4, 0.5)
    bpy.context.view_layer.update()
    assert bpy.ops.patina.find_lights() == {"FINISHED"}
    bpy.context.view_layer.update()
    read = extension("core.capture").read_capture
    dragged = extension("scene.photos.dragged_lamps")
    capture, _ = dragged.with_dragged_lamps(read(path), scene)
    found = capture.lights[0]
    assert 0 < np.degrees(found.standard_error) < 5
    assert degrees(found.direction, true) < 2 * np.degrees(found.standard_error)
