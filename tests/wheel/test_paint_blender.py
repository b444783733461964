"""Masks and materials painted by hand: on photos, on the mesh, stored in the .blend, and used by a
fit.
"""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

pytest.importorskip("bpy")
pytestmark = pytest.mark.blender

import bpy  # noqa: E402

from tests import make_capture as made  # noqa: E402
from tests.wheel.test_masks_blender import scene, slots, truth, two_coloured  # noqa: E402, F401


def _paint(image: bpy.types.Image, where: np.ndarray, colour: tuple[int, int, int]) -> None:
    """Paint as an opaque brush does; where: (h, w), the first row on top."""
    width, height = image.size
    pixels = np.empty((height, width, image.channels), np.float32)
    image.pixels.foreach_get(pixels.ravel())
    pixels[where[::-1], :3] = np.array(colour) / 255
    image.pixels.foreach_set(pixels.ravel())
    image.update()


def _canvas(scene, place: int) -> bpy.types.Image:  # noqa: F811
    from patina.scene.paint.canvas import canvases
    from patina.scene.session.scene_properties import capture_path

    scene.patina_photos.active = place
    assert bpy.ops.patina.paint_photo() == {"FINISHED"}
    return canvases(capture_path(scene))[place]


def _colour(scene, name: str) -> tuple[int, int, int]:  # noqa: F811
    from patina.scene.paint.paint_kinds import paints

    return next(paint.colour for paint in paints(scene) if paint.name == name)


def _two_materials(scene) -> None:  # noqa: F811
    assert bpy.ops.patina.add_material(name="blue half") == {"FINISHED"}
    assert [m.name for m in scene.patina.mesh.data.materials][-1] == "blue half"
    assert scene.patina.use_slots and (slots(scene.patina.mesh) == 0).all()


def test_strokes_on_photos_are_projected_to_mesh_and_back(scene) -> None:  # noqa: F811
    """The second half is painted in every photo where its faces are visible: the mesh takes it
    over, and every canvas shows it.
    """
    from patina.scene.paint.canvas import canvases
    from patina.scene.paint.mask_images import read_pixels
    from patina.scene.scan.scan_rays import scan_rays
    from patina.scene.session.scene_properties import capture_path

    _two_materials(scene)
    mesh, capture = scene.patina.mesh, capture_path(scene)
    true = truth(mesh)
    colour = _colour(scene, "blue half")
    for place in range(5):
        image = _canvas(scene, place)
        where = scan_rays(capture).faces_of(place).image(true) == 1
        assert where.any()
        _paint(image, where, colour)
    assert bpy.ops.patina.take_paint() == {"FINISHED"}
    found = slots(mesh)
    seen = np.zeros(len(true), bool)
    for place in range(5):
        seen[scan_rays(capture).faces_of(place).face] = True
    assert seen.mean() > 0.7  # no photo shows the poles
    assert (found[seen] == true[seen]).mean() > 0.98
    image = canvases(capture)[0]
    shown = read_pixels(image).astype(int)
    mine = scan_rays(capture).faces_of(0).image(found) == 1
    half = scene.patina_paint.opacity
    assert np.abs(shown[mine] - half * np.array(colour)).min(axis=0).max() < 40
    assert bpy.ops.patina.take_paint() == {"FINISHED"}
    assert np.array_equal(slots(mesh), found)  # strokes that were taken are not taken again


def test_painted_ignore_mask_is_used_by_fit(scene, tmp_path: Path) -> None:  # noqa: F811
    from patina.core.capture import read_capture
    from patina.core.photo import read_mask
    from patina.scene.paint.mask_images import mask_images, with_mask_images
    from patina.scene.session.scene_properties import capture_path

    capture = capture_path(scene)
    image = _canvas(scene, 1)
    where = np.zeros((made.HEIGHT, made.WIDTH), bool)
    where[30:50, 40:70] = True
    _paint(image, where, _colour(scene, "Ignore"))
    bright = np.zeros_like(where)
    bright[60:66, 60:66] = True
    _paint(image, bright, _colour(scene, "Highlight"))
    assert bpy.ops.patina.take_paint() == {"FINISHED"}
    kinds = {kind for place, kind in mask_images(capture) if place == 1}
    assert kinds == {"ignore", "highlight"}
    masked_capture = with_mask_images(read_capture(Path(capture)))
    assert np.array_equal(read_mask(masked_capture.photos[1].masks["ignore"]), where)
    assert np.array_equal(read_mask(masked_capture.photos[1].masks["highlight"]), bright)
    assert not masked_capture.photos[0].masks

    # the eraser removes a part of it
    gone = np.zeros_like(where)
    gone[30:40] = True
    _paint(image, gone, _colour(scene, "Erase"))
    # saving takes the strokes and packs them; the files may be deleted
    file = tmp_path / "painted.blend"
    bpy.ops.wm.save_as_mainfile(filepath=str(file))
    for folder in (Path(masked_capture.photos[1].masks["ignore"]).parent,):
        for mask in folder.iterdir():
            mask.unlink()
    bpy.ops.wm.open_mainfile(filepath=str(file))
    again = with_mask_images(read_capture(Path(capture)))
    assert np.array_equal(read_mask(again.photos[1].masks["ignore"]), where & ~gone)
    assert np.array_equal(read_mask(again.photos[1].masks["highlight"]), bright & ~gone)


def test_canvas_without_pixels_erases_nothing(scene) -> None:  # noqa: F811
    from patina.scene.paint.mask_images import mask_images, read_mask_image
    from patina.scene.session.scene_properties import capture_path

    image = _canvas(scene, 0)
    where = np.zeros((made.HEIGHT, made.WIDTH), bool)
    where[20:40, 30:50] = True
    _paint(image, where, _colour(scene, "Ignore"))
    assert bpy.ops.patina.take_paint() == {"FINISHED"}
    pixels = np.zeros(len(image.pixels), np.float32)
    image.pixels.foreach_set(pixels)
    assert bpy.ops.patina.take_paint() == {"FINISHED"}
    assert np.array_equal(read_mask_image(mask_images(capture_path(scene))[0, "ignore"]), where)
    image.pixels.foreach_get(pixels)
    assert pixels.max() > 0.5  # drawn anew
    image.reload()  # as when Blender frees pixels that were never painted
    assert bpy.ops.patina.take_paint() == {"FINISHED"}
    assert np.array_equal(read_mask_image(mask_images(capture_path(scene))[0, "ignore"]), where)


def test_fit_ignores_painted_out_photo(scene) -> None:  # noqa: F811
    """One photo is painted out entirely: none of its pixels is used, even without pressing Take."""
    from patina.scene.session.scene_properties import capture_path, stored_result

    def counts() -> list[int]:
        stored = stored_result(capture_path(scene))
        return list(stored["materials"][0]["samples"]["per_photo"].values())

    assert bpy.ops.patina.fit() == {"FINISHED"}
    before = counts()
    image = _canvas(scene, 0)
    _paint(image, np.ones((made.HEIGHT, made.WIDTH), bool), _colour(scene, "Ignore"))
    assert bpy.ops.patina.fit() == {"FINISHED"}
    after = counts()
    assert before[0] > 0 and after[0] == 0
    assert after[1:] == before[1:]


def test_vertex_paint_is_converted_to_material_slots(scene) -> None:  # noqa: F811
    _two_materials(scene)
    mesh = scene.patina.mesh
    assert bpy.ops.patina.paint_mesh() == {"FINISHED"}
    assert mesh.mode == "VERTEX_PAINT"
    layer = mesh.data.color_attributes.active_color
    true = truth(mesh)
    corners = np.ones((len(mesh.data.loops), 4), np.float32)
    layer.data.foreach_get("color_srgb", corners.ravel())
    mine = np.repeat(true == 1, 3)
    corners[mine, :3] = np.array(_colour(scene, "blue half")) / 255
    layer.data.foreach_set("color_srgb", corners.ravel())
    bpy.ops.object.mode_set(mode="OBJECT")
    assert bpy.ops.patina.take_paint() == {"FINISHED"}
    assert np.array_equal(slots(mesh), true)
    # repainted elsewhere since its colours were shown: old paint does not return
    mesh.data.polygons.foreach_set("material_index", np.zeros(len(true), np.int32))
    assert bpy.ops.patina.take_paint() == {"FINISHED"}
    assert (slots(mesh) == 0).all()


def test_large_photo_is_painted_at_reduced_size(scene, monkeypatch) -> None:  # noqa: F811
    """One canvas pixel covers three photo pixels; the sides are not multiples of three."""
    from patina.scene.paint import canvas
    from patina.scene.paint.mask_images import mask_images, read_mask_image
    from patina.scene.session.scene_properties import capture_path

    monkeypatch.setattr(canvas, "MAX_CANVAS_SIDE", 47)
    _two_materials(scene)
    image = _canvas(scene, 0)
    assert tuple(image.size) == (40, 30)
    where = np.zeros((30, 40), bool)
    where[5:9, 10:15] = True
    _paint(image, where, _colour(scene, "Ignore"))
    where_blue = np.zeros((30, 40), bool)
    where_blue[14:20, 15:25] = True
    _paint(image, where_blue, _colour(scene, "blue half"))
    assert bpy.ops.patina.take_paint() == {"FINISHED"}
    mask = read_mask_image(mask_images(capture_path(scene))[0, "ignore"])
    assert np.array_equal(mask, np.kron(where, np.ones((3, 3))).astype(bool))
    assert (slots(scene.patina.mesh) == 1).any()
    assert bpy.ops.patina.take_paint() == {"FINISHED"}
    assert np.array_equal(read_mask_image(mask_images(capture_path(scene))[0, "ignore"]), mask)


def test_face_sets_become_materials(scene) -> None:  # noqa: F811
    mesh = scene.patina.mesh
    true = truth(mesh)
    sets = mesh.data.attributes.new(".sculpt_face_set", "INT", "FACE")
    sets.data.foreach_set("value", (1 + 4 * true).astype(np.int32))
    assert bpy.ops.patina.slots_from_face_sets() == {"FINISHED"}
    assert np.array_equal(slots(mesh), true)
    assert len(mesh.data.materials) == 2 and scene.patina.use_slots


def test_masks_are_exported(scene, tmp_path: Path) -> None:  # noqa: F811
    from patina.core.photo import read_mask

    _two_materials(scene)
    mesh = scene.patina.mesh
    mesh.data.polygons.foreach_set("material_index", truth(mesh).astype(np.int32))
    image = _canvas(scene, 0)
    where = np.zeros((made.HEIGHT, made.WIDTH), bool)
    where[40:50, 50:60] = True
    _paint(image, where, _colour(scene, "Shadow"))
    assert bpy.ops.patina.export_masks(directory=str(tmp_path / "masks")) == {"FINISHED"}
    names = sorted(p.name for p in (tmp_path / "masks").iterdir())
    assert "001_lit_1_shadow.png" in names and "001_lit_1_blue_half.png" in names
    assert np.array_equal(read_mask(tmp_path / "masks" / "001_lit_1_shadow.png"), where)


def test_import_again_keeps_painted_masks(scene) -> None:  # noqa: F811
    from patina.scene.paint.mask_images import mask_images
    from patina.scene.session.scene_properties import capture_path

    assert bpy.ops.patina.shadow_masks() == {"FINISHED"}
    image = mask_images(capture_path(scene))[0, "shadow"]
    soft = np.empty(len(image.pixels), np.float32)
    image.pixels.foreach_get(soft)
    greys = set(np.unique(np.round(255 * soft)).tolist())
    _two_materials(scene)
    mesh = scene.patina.mesh
    true = truth(mesh)
    mesh.data.polygons.foreach_set("material_index", true.astype(np.int32))
    canvas = _canvas(scene, 0)
    where = np.zeros((made.HEIGHT, made.WIDTH), bool)
    where[:3, :3] = True
    _paint(canvas, where, _colour(scene, "Shadow"))
    assert bpy.ops.patina.take_paint() == {"FINISHED"}
    image.pixels.foreach_get(soft)
    assert set(np.unique(np.round(255 * soft)).tolist()) | {255} == greys | {255}
    for gone in list(scene.objects):
        bpy.data.objects.remove(gone)
    assert bpy.ops.patina.import_capture(filepath=capture_path(scene)) == {"FINISHED"}
    assert scene.patina.mesh is not mesh and np.array_equal(slots(scene.patina.mesh), true)
    assert [m.name for m in scene.patina.mesh.data.materials] == ["surface", "blue half"]
    assert len(mask_images(capture_path(scene))) == 5


def test_reasons_for_rejection_are_reported(scene) -> None:  # noqa: F811
    with pytest.raises(RuntimeError, match="only one material"):
        bpy.ops.patina.paint_mesh()
    with pytest.raises(RuntimeError, match="only one face set"):
        bpy.ops.patina.slots_from_face_sets()
    scene.camera = None
    assert not bpy.ops.patina.paint_photo.poll()
