"""Proposed materials and shadow masks as a user meets them in Blender, and a fit that uses both."""

from __future__ import annotations

import json
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest

pytest.importorskip("bpy")
pytestmark = pytest.mark.blender

import bpy  # noqa: E402

from tests import make_capture as made  # noqa: E402
from tests.core.test_material_proposal import halves, painted  # noqa: E402

PAINTS = [((0.2, 0.04, 0.03), 0.3, 40), ((0.04, 0.06, 0.2), 0.3, 40)]


@pytest.fixture(scope="module")
def two_coloured(tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("two")
    path = made.make_capture(folder, photos=5, brdf=painted(PAINTS, halves))
    made.write_ply(folder / "mesh.ply", *made.sphere_mesh(4))
    return path


@pytest.fixture
def scene(two_coloured: Path):
    import patina

    bpy.ops.wm.read_homefile(use_factory_startup=True)
    already = hasattr(bpy.types.Scene, "patina")
    if not already:
        patina.register()
    assert bpy.ops.patina.import_capture(filepath=str(two_coloured)) == {"FINISHED"}
    yield bpy.context.scene
    if not already:
        patina.unregister()


def slots(mesh) -> np.ndarray:
    found = np.empty(len(mesh.data.polygons), np.int32)
    mesh.data.polygons.foreach_get("material_index", found)
    return found


def truth(mesh) -> np.ndarray:
    centres = np.empty((len(mesh.data.polygons), 3), np.float32)
    mesh.data.polygons.foreach_get("center", centres.ravel())
    away = centres - made.CENTRE
    return halves(away / np.linalg.norm(away, axis=1, keepdims=True))


def test_proposed_materials_become_slots_used_by_fit(scene) -> None:
    mesh = scene.patina.mesh
    assert bpy.ops.patina.propose_materials() == {"FINISHED"}
    found, true = slots(mesh), truth(mesh)
    if (found == true).mean() < 0.5:
        true = 1 - true
    assert (found == true).mean() > 0.96
    assert [m.name for m in mesh.data.materials] == ["material_1", "material_2"]
    first, second = (np.array(m.diffuse_color) for m in mesh.data.materials)
    assert np.abs(first - second).max() > 0.3
    attribute = mesh.data.attributes["patina_materials"]
    stored = np.empty(len(found), np.int32)
    attribute.data.foreach_get("value", stored)
    assert attribute.domain == "FACE" and np.array_equal(stored, found)

    # again: the same slots, no second set of placeholder materials
    before = len(bpy.data.materials)
    assert bpy.ops.patina.propose_materials(count=2) == {"FINISHED"}
    assert len(bpy.data.materials) == before

    # repaint: assign every face its true material in Edit Mode, and rename a slot
    mesh.data.polygons.foreach_set("material_index", true.astype(np.int32))
    mesh.data.materials[0].name = "red/gold"
    scene.patina.use_slots = True
    bpy.context.view_layer.objects.active = mesh
    bpy.ops.object.mode_set(mode="EDIT")
    assert bpy.ops.patina.fit() == {"FINISHED"}
    assert mesh.mode == "OBJECT"
    assert np.array_equal(slots(mesh), true)
    from patina.scene.session.scene_properties import capture_path, stored_result

    first_fit = stored_result(capture_path(scene))
    assert [m["name"] for m in first_fit["materials"]] == ["red_gold", "material_2"]

    # a second fit keeps the names, although the slots now have measured materials
    assert bpy.ops.patina.fit() == {"FINISHED"}
    again = stored_result(capture_path(scene))
    assert [m["name"] for m in again["materials"]] == ["red_gold", "material_2"]
    assert json.dumps(again["materials"][0]["coefficients"]) == json.dumps(
        first_fit["materials"][0]["coefficients"]
    )


def test_slots_are_not_fitted_without_consent(scene) -> None:
    from patina.core.capture import read_capture
    from patina.scene.scan.face_slots import with_painted_slots

    capture = read_capture(Path(scene.patina.capture))
    assert with_painted_slots(capture, scene) == (capture, None)
    scene.patina.use_slots = True
    with pytest.raises(RuntimeError, match="no material slots"):
        bpy.ops.patina.fit()


def test_edited_mesh_is_rejected(scene) -> None:
    import bmesh

    mesh = scene.patina.mesh
    work = bmesh.new()
    work.from_mesh(mesh.data)
    bmesh.ops.delete(work, geom=list(work.faces)[:5], context="FACES")
    work.to_mesh(mesh.data)
    work.free()
    with pytest.raises(RuntimeError, match="faces, the scan"):
        bpy.ops.patina.propose_materials(count=2)
    mesh.data.materials.append(bpy.data.materials.new("one"))
    scene.patina.use_slots = True
    with pytest.raises(RuntimeError, match="faces, the scan"):
        bpy.ops.patina.fit()


def test_painted_shadow_masks_are_used_by_fit(scene) -> None:
    from patina.core.capture import read_capture
    from patina.core.photo import read_mask
    from patina.scene.paint.mask_images import shadow_images, with_mask_images

    path = scene.patina.capture
    assert bpy.ops.patina.shadow_masks() == {"FINISHED"}
    images = shadow_images(str(Path(path).resolve()))
    assert sorted(images) == [0, 1, 2, 3, 4]
    image = images[0]
    assert tuple(image.size) == (made.WIDTH, made.HEIGHT)
    pixels = np.empty(image.size[0] * image.size[1] * image.channels, np.float32)
    image.pixels.foreach_get(pixels)
    assert pixels.max() > 0.99 and (pixels == 0).any()
    pixels[:] = 1.0  # the user paints all of it
    image.pixels.foreach_set(pixels)
    image.update()
    with pytest.raises(RuntimeError, match="already"):
        bpy.ops.patina.shadow_masks()
    capture = with_mask_images(read_capture(Path(path)))
    assert read_mask(capture.photos[0].masks["shadow"]).all()
    assert not read_mask(capture.photos[1].masks["shadow"]).all()
    file = Path(bpy.path.abspath(image.filepath))
    leftovers = {p.name for p in file.parents[1].iterdir() if p.name.startswith(".patina")}
    assert leftovers == {".patina-files"}
    assert bpy.ops.patina.shadow_masks(replace=True) == {"FINISHED"}
    assert not read_mask(file).all()
    assert len(shadow_images(str(Path(path).resolve()))) == 5
    file.unlink()  # the .blend contains it
    again = with_mask_images(read_capture(Path(path)))
    assert not read_mask(again.photos[0].masks["shadow"]).all()
    bpy.data.images.remove(images[1])
    assert "shadow" not in with_mask_images(read_capture(Path(path))).photos[1].masks


def test_headless_masks_then_import(root: Path, two_coloured: Path, tmp_path: Path) -> None:
    """A one-line message for a mistake; otherwise masks and a capture file."""

    def headless(*arguments: object) -> subprocess.CompletedProcess[str]:
        return subprocess.run(
            [sys.executable, root / "headless.py", *map(str, arguments)],
            capture_output=True, text=True, timeout=300,
        )  # fmt: skip

    bad = headless("masks", two_coloured, "--out", tmp_path / "o", "--materials", "many")
    assert bad.returncode == 2 and len(bad.stderr.strip().splitlines()) == 1
    same = headless("masks", two_coloured, "--out", two_coloured.parent)
    assert same.returncode == 2 and "overwritten" in same.stderr
    out = tmp_path / "out"
    done = headless("masks", two_coloured, "--out", out, "--shadows", "--materials", "auto")
    assert done.returncode == 0, done.stderr
    assert len(list((out / "masks").iterdir())) == 15
    from patina.core.capture import read_capture

    capture = read_capture(out / two_coloured.name)
    assert len(capture.materials) == 2
