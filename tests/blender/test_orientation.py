"""The scan stands upright in Blender, and nothing that is measured changes with its orientation."""

from __future__ import annotations

from pathlib import Path

import bpy
import numpy as np
from support import extension
from test_workflow import folder


def demo() -> bpy.types.Scene:
    assert bpy.ops.patina.import_demo() == {"FINISHED"}
    return bpy.context.scene


def world(thing: bpy.types.Object) -> np.ndarray:
    return extension("scene.photos.lamp_placement").world_matrix(thing)


def views(scene: bpy.types.Scene) -> dict[str, np.ndarray]:
    """The mesh as each camera and each lamp sees it: what photos, evidence and fits depend on."""
    mesh = world(scene.patina.mesh)
    lamps = [o for o in scene.objects if "patina_light" in o and o.type == "LIGHT"]
    return {o.name: np.linalg.inv(world(o)) @ mesh for o in (*lamps, *cameras(scene))}


def cameras(scene: bpy.types.Scene) -> list[bpy.types.Object]:
    """Those of the scan; Blender's own camera is not turned."""
    return [o for o in scene.objects if "patina_label" in o]


def mean_up(scene: bpy.types.Scene) -> np.ndarray:
    up = np.sum([world(o)[:3, 1] for o in cameras(scene)], axis=0)
    return up / np.linalg.norm(up)


def test_demo_stands_upright() -> None:
    scene = demo()
    assert mean_up(scene)[2] > 0.98, "the frame of the demo's files lies on its side"
    state = scene.patina_orientation
    found = extension("scene.scan.orientation").found_up(
        extension("scene.scan.orientation").scan_collections(scene)[0]
    )
    assert state.up_axis == "FOUND" and found.reliable and found.standard_error < 0.02
    turned = world(scene.patina.mesh)[:3, :3] @ found.direction
    np.testing.assert_allclose(turned, [0, 0, 1], atol=1e-6)


def test_every_axis_turns_everything_together() -> None:
    scene = demo()
    before, edits = views(scene), extension("scene.photos.dragged_lamps")
    capture = extension("core.capture").read_capture(Path(scene.patina.capture))
    axes = extension("scene.scan.orientation").AXES
    for axis in ("X", "NEG_Y", "Z", "NEG_Z", "FOUND"):
        scene.patina_orientation.up_axis = axis
        now = views(scene)
        assert now.keys() == before.keys()
        for name, matrix in before.items():
            np.testing.assert_allclose(now[name], matrix, atol=3e-6, err_msg=name)
        if axis != "FOUND":
            turned = world(scene.patina.mesh)[:3, :3] @ axes[axis]
            np.testing.assert_allclose(turned, [0, 0, 1], atol=1e-6)
        assert edits.with_dragged_lamps(capture, scene)[1] == [], "a turn counts as an edit"
    assert mean_up(scene)[2] > 0.98


def test_lamp_that_is_moved_after_a_turn_is_read_in_the_scan_frame() -> None:
    scene = demo()
    edits = extension("scene.photos.dragged_lamps")
    capture = extension("core.capture").read_capture(Path(scene.patina.capture))
    lamp = edits.lamp_of(scene, str(capture.file), "key")
    entry = next(light for light in capture.lights if light.name == "key")
    lamp.rotation_mode = "QUATERNION"
    lamp.rotation_quaternion = (1, 0, 0, 0)  # from above in Blender
    changed, names = edits.with_dragged_lamps(capture, scene)
    assert names == ["key"]
    direction = next(light for light in changed.lights if light.name == "key").direction
    found = extension("scene.scan.orientation").scan_collections(scene)[0]
    up = extension("scene.scan.orientation").found_up(found).direction
    np.testing.assert_allclose(direction, up, atol=1e-5)
    assert not np.allclose(entry.direction if entry.direction is not None else 0, up, atol=0.1)


def test_orientation_is_saved_and_exported_upright() -> None:
    scene = demo()
    up = mean_up(scene)
    path = str(folder() / "upright.blend")
    bpy.ops.wm.save_as_mainfile(filepath=path)
    bpy.ops.wm.open_mainfile(filepath=path)
    scene = bpy.context.scene
    np.testing.assert_allclose(mean_up(scene), up)
    mesh = scene.patina.mesh
    corners = np.array([mesh.matrix_world @ v.co for v in mesh.data.vertices])
    glb = folder() / "scan.glb"
    extension("scene.export.export_gltf").write_glb(glb, [mesh])
    bpy.ops.wm.read_homefile(use_empty=True)
    bpy.ops.import_scene.gltf(filepath=str(glb))
    thing = next(o for o in bpy.data.objects if o.type == "MESH")
    again = np.array([thing.matrix_world @ v.co for v in thing.data.vertices])
    np.testing.assert_allclose(again.min(axis=0), corners.min(axis=0), atol=1e-4)
    np.testing.assert_allclose(again.max(axis=0), corners.max(axis=0), atol=1e-4)
