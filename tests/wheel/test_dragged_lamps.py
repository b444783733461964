"""Edits of lamps by the user, and which light the next fit uses."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np
import pytest

pytest.importorskip("bpy")
pytestmark = pytest.mark.blender

import bpy  # noqa: E402
from mathutils import Matrix, Vector  # noqa: E402

from patina.core.capture import Capture, read_capture  # noqa: E402
from patina.core.errors import PatinaError  # noqa: E402
from patina.core.inputs import capture_data  # noqa: E402
from patina.core.inputs.lights import Lights  # noqa: E402
from patina.core.light import DistantLight, MountedLight, NearLight  # noqa: E402
from patina.core.scan import Scan  # noqa: E402
from patina.scene.photos import dragged_lamps, photo_list  # noqa: E402
from patina.scene.photos.lamps import shine_only  # noqa: E402
from patina.scene.scan.scan_collection import create_scan_collection  # noqa: E402
from tests import make_capture as made  # noqa: E402

FAR = [np.zeros(3), np.array([500_000.0, 4_000_000.0, 120.0])]
SUN = np.array([0.6, 0.0, 0.8])
AT = made.CENTRE + np.array([1.5, 0.4, 2.5])
OFFSET = np.array([0.3, -0.2, 0.1])
WHITE = np.array([3.0, 2.5, 2.0])

TEXT = """
[[light]]
name = "sun"
sun = {latitude = 40.0, longitude = 10.0, time = "2020-06-01T12:00:00Z", north = [0, 1, 0], up = [0, 0, 1]}
white = {photo = "lit_1.exr", mask = "white.png", reflectance = 0.9}
[[light]]
name = "ball"
sphere = {photo = "lit_1.exr", camera = "view_01.jpg"}
irradiance = [1.0, 1.0, 1.0]
[[light]]
name = "lamp"
position = [%r, %r, %r]
intensity = [4.0, 5.0, 6.0]
radius = 0.1
[[light]]
name = "flash"
mounted = [0.3, -0.2, 0.1]
intensity = [4.0, 5.0, 6.0]
"""  # noqa: E501


@dataclass
class Built:
    capture: Capture
    scene: bpy.types.Scene
    lamps: dict[str, bpy.types.Object]
    cameras: list[bpy.types.Object]
    mesh: bpy.types.Object
    scan: Scan

    def now(self) -> tuple[dict, list[str]]:
        capture, names = dragged_lamps.with_dragged_lamps(self.capture, self.scene)
        return {light.name: light for light in capture.lights}, names


def _build(folder: Path, far: np.ndarray, known: bool = True) -> Built:
    """Four photos, each under a light of another kind; the scan at distance ``far`` from the
    origin.
    """
    path = made.make_capture(folder, photos=4)
    made.write_png(folder / "white.png", np.full((made.HEIGHT, made.WIDTH), 255))
    head, tail = path.read_text().split("[[light]]", 1)
    photos = tail[tail.index("[[photo]]") :]
    for i, name in enumerate(("sun", "ball", "lamp", "flash"), start=1):
        photos = photos.replace(f'"lamp{i}"', f'"{name}"')
    body = TEXT % tuple(float(x) for x in AT + far)
    path.write_text(f"{head}{body}\n\n{photos}")
    capture = read_capture(path)
    # a file may not mix near and distant lights in this way, because they have no common scale
    if not known:
        bare = (replace(light, strength=None, white=None) for light in capture.lights)
        capture = replace(capture, lights=tuple(bare))
    scan = capture_data.open_scan(capture)
    moved = [
        replace(c, pose=replace(c.pose, translation=c.pose.translation - c.pose.rotation @ far))
        for c in scan.cameras
    ]
    scan = replace(
        scan, cameras=tuple(moved), mesh=replace(scan.mesh, vertices=scan.mesh.vertices + far)
    )
    strength = {"sun": WHITE, "ball": np.ones(3), "lamp": np.array([4.0, 5, 6])}
    if not known:
        strength = dict.fromkeys(strength)
    found = Lights(
        {
            "sun": DistantLight("sun", SUN, strength["sun"], 0.00465),
            "ball": DistantLight("ball", np.array([0.0, 0.6, 0.8]), strength["ball"]),
            "lamp": NearLight("lamp", AT + far, strength["lamp"], 0.1),
            "flash": MountedLight("flash", OFFSET, strength["lamp"]),
        }
    )
    bpy.ops.wm.read_homefile(use_factory_startup=True)
    scene = bpy.context.scene
    built = create_scan_collection(scene, capture, scan, found, folder / "rectified")
    photo_cameras = [built.cameras[photo.camera] for photo in capture.photos]
    return Built(capture, scene, built.lamps, photo_cameras, built.mesh, scan)


@pytest.fixture(params=FAR, ids=["here", "far"])
def built(request, tmp_path: Path) -> Built:
    return _build(tmp_path, request.param)


@pytest.fixture(autouse=True, scope="module")
def listed_photos() -> Iterator[None]:
    """A scan's collection fills the scene's list of photos, which the add-on registers."""
    photo_list.register()
    yield
    photo_list.unregister()


def _step_through(built: Built) -> None:
    for camera in (*built.cameras, *built.cameras[::-1]):
        shine_only(built.scene, camera)
        bpy.context.view_layer.update()


def test_untouched_lamps_keep_their_lights(built: Built, tmp_path: Path) -> None:
    """Rounding is not an edit: neither after stepping through the photos, nor in a saved file."""
    assert built.now()[1] == []
    _step_through(built)
    bpy.ops.wm.save_as_mainfile(filepath=str(tmp_path / "x.blend"))
    bpy.ops.wm.open_mainfile(filepath=str(tmp_path / "x.blend"))
    entries, names = dragged_lamps.with_dragged_lamps(built.capture, bpy.context.scene)
    assert names == []
    assert all(a is b for a, b in zip(entries.lights, built.capture.lights, strict=True))


def test_lamp_is_at_light_position(built: Built) -> None:
    _step_through(built)
    origin = _origin(built)
    assert np.allclose(np.array(built.lamps["lamp"].matrix_world.translation) + origin,
                       built.capture.lights[2].position, atol=1e-6, rtol=0)  # fmt: skip
    flash = MountedLight("flash", OFFSET)
    shine_only(built.scene, built.cameras[3])
    bpy.context.view_layer.update()
    camera = capture_data.camera_of(built.capture, built.scan, 3)
    here = np.array(built.lamps["flash"].matrix_world.translation) + origin
    assert np.allclose(here, flash.position(camera), atol=2e-6, rtol=0)


def _origin(built: Built) -> np.ndarray:
    return np.array(
        next(c["patina_origin"] for c in built.scene.collection.children if "patina_origin" in c)
    )


@pytest.mark.parametrize("update", [True, False])
def test_dragged_lamp_is_used(built: Built, update: bool) -> None:
    """update: as in the window, where Blender has evaluated the drag, or at once in a script."""
    lamps = built.lamps
    towards = np.array([0.1, -0.7, 0.5]) / np.linalg.norm([0.1, -0.7, 0.5])
    lamps["sun"].rotation_mode = "XYZ"  # users do this
    lamps["sun"].rotation_euler = Vector(towards).to_track_quat("Z", "Y").to_euler()
    lamps["sun"].location = (9, 9, 9)  # has no meaning
    lamps["lamp"].location = lamps["lamp"].location + Vector((0.5, 0, 0.25))
    lamps["flash"].location = (0.1, 0.2, -0.3)
    if update:
        bpy.context.view_layer.update()
    now, names = built.now()
    assert names == ["sun", "lamp", "flash"]
    old = {light.name: light for light in built.capture.lights}
    assert np.allclose(now["sun"].direction, towards, atol=1e-6)
    assert now["sun"].sun is None and now["sun"].sphere is None
    assert now["sun"].white is old["sun"].white and now["sun"].strength is None
    assert np.isclose(now["sun"].angle, 2 * 0.00465, rtol=1e-5)  # still has the sun's angular size
    moved = now["lamp"].position - old["lamp"].position
    assert np.allclose(moved, (0.5, 0, 0.25), atol=1e-6, rtol=0)
    assert now["lamp"].strength is old["lamp"].strength and now["lamp"].radius == 0.1
    assert np.allclose(now["flash"].mounted, (0.1, -0.2, 0.3), atol=1e-6)  # right, down, forward
    assert now["ball"] is old["ball"]


def test_flash_dragged_on_one_camera_moves_on_all(built: Built) -> None:
    shine_only(built.scene, built.cameras[3])
    built.lamps["flash"].location = (0.1, 0.2, -0.3)
    _step_through(built)
    assert np.allclose(built.now()[0]["flash"].mounted, (0.1, -0.2, 0.3), atol=1e-6)


def test_edited_strength_and_size_are_used(built: Built) -> None:
    lamps = built.lamps
    lamps["sun"].data.energy *= 2
    lamps["lamp"].data.color = (1.0, 0.5, 0.25)
    lamps["ball"].data.exposure = 1.0
    lamps["flash"].data.shadow_soft_size = 0.3
    now, names = built.now()
    assert names == ["sun", "ball", "lamp", "flash"]
    assert np.allclose(now["sun"].strength, 2 * WHITE, rtol=1e-6) and now["sun"].white is None
    assert now["sun"].sun is not None
    assert np.allclose(now["lamp"].strength, 6 * np.array([1.0, 0.5, 0.25]), rtol=1e-6)
    assert np.allclose(now["ball"].strength, 2.0) and now["ball"].sphere is not None
    assert np.isclose(now["flash"].radius, 0.3)
    lamps["lamp"].data.energy = 0.0
    with pytest.raises(PatinaError, match=r"lamp.*emits no light"):
        built.now()


def test_unknown_strength_stays_unknown(tmp_path: Path) -> None:
    built = _build(tmp_path, FAR[0], known=False)
    for lamp in built.lamps.values():
        lamp.data.energy *= 3
    assert built.now()[1] == []


def test_transform_of_whole_scan_changes_no_light(built: Built) -> None:
    """Mesh, cameras and lamps transformed together, by a parent or one by one; then a drag."""
    _step_through(built)
    turn = Matrix.Translation((1, 2, 3)) @ Matrix.Rotation(1.1, 4, "X") @ Matrix.Scale(0.5, 4)
    for item in [*built.cameras, built.mesh, *built.lamps.values()]:
        if item.parent is None:
            item.matrix_world = turn @ item.matrix_world
    bpy.context.view_layer.update()
    assert built.now()[1] == []
    lamp = built.lamps["lamp"]
    lamp.location = lamp.location + (turn.to_3x3() @ Vector((0.5, 0.0, 0.0)))
    now, names = built.now()
    assert names == ["lamp"]
    moved = now["lamp"].position - built.capture.lights[2].position
    assert np.allclose(moved, (0.5, 0, 0), atol=1e-5)


def test_moved_mesh_changes_no_light(built: Built) -> None:
    built.mesh.matrix_world = Matrix.Translation((5, 0, 0)) @ Matrix.Rotation(0.3, 4, "Z")
    assert built.now()[1] == []


def test_unusual_edits_do_not_crash(built: Built) -> None:
    lamps, scene = built.lamps, built.scene
    copy = lamps["lamp"].copy()
    copy.data = copy.data.copy()
    copy.location = (7, 7, 7)
    lamps["lamp"].users_collection[0].objects.link(copy)
    assert built.now()[1] == []  # the copy is not the light
    bpy.data.objects.remove(lamps["lamp"])
    assert built.now()[1] == ["lamp"]  # now it is the light
    _step_through(built)
    lamps["sun"].data.type = "AREA"
    lamps["ball"].scale = (0, 0, 0)
    assert built.now()[1] == ["lamp"]
    shine_only(scene, built.cameras[3])
    bpy.data.objects.remove(built.cameras[3])
    assert built.now()[1] == ["lamp"]  # the flash lost its camera
    empty = bpy.data.objects.new("rig", None)
    scene.collection.objects.link(empty)
    lamps["ball"].scale = (1, 1, 1)
    lamps["ball"].constraints.new("TRACK_TO").target = empty
    for layer in scene.view_layers:
        layer.layer_collection.children[-1].exclude = True
    _step_through(replace(built, cameras=built.cameras[:3]))
    built.now()
    bpy.data.objects.remove(built.mesh)
    built.now()
    for name in ("sun", "ball", "flash"):
        bpy.data.objects.remove(lamps[name])
    bpy.data.objects.remove(copy)
    assert built.now()[1] == []


def test_saved_lights_are_the_new_reference(built: Built) -> None:
    lamps = built.lamps
    lamps["lamp"].location = (1, 2, 3)
    lamps["flash"].location = (0.1, 0.2, -0.3)
    lamps["sun"].rotation_quaternion = (0.9, 0.1, 0.2, 0.3)
    assert len(built.now()[1]) == 3
    dragged_lamps.accept(built.capture, built.scene)
    assert built.now()[1] == []
    _step_through(built)
    assert built.now()[1] == []
