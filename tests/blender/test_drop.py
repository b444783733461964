"""Files dropped onto a viewport: which operator accepts them, and what it creates."""

from __future__ import annotations

from types import SimpleNamespace

import bpy
import numpy as np
from support import extension
from test_workflow import counts, folder, make_capture_module


def handlers() -> dict[str, type]:
    found = bpy.types.FileHandler.__subclasses__()
    return {cls.bl_idname: cls for cls in found if cls.bl_idname.startswith("PATINA_")}


def drop(*names: str) -> str:
    """The operator that Blender would call for files of these names, dropped over a viewport."""
    suffixes = {"." + name.rpartition(".")[2].lower() for name in names}
    fits = [cls for cls in handlers().values() if suffixes & set(cls.bl_file_extensions.split(";"))]
    assert len(fits) == 1, (names, fits)
    group, operator = fits[0].bl_import_operator.split(".")
    assert hasattr(getattr(bpy.ops, group), operator)
    return fits[0].bl_import_operator


def make_scan(photos: int = 3):
    """A scan without a capture file; its lit photos are named like the scan's."""
    path = make_capture_module().make_capture(folder() / "ball", photos=photos)
    path.unlink()
    lit = path.parent / "lit"
    lit.mkdir()
    for k in range(photos):
        (path.parent / f"lit_{k + 1}.exr").rename(lit / f"view_{k + 1:02d}.exr")
    return path.parent


def files(*names: str) -> list[dict[str, str]]:
    return [{"name": name} for name in names]


def error_message(operator, **settings) -> str:
    try:
        operator(**settings)
    except RuntimeError as error:
        assert "Traceback" not in str(error), error
        return str(error)
    raise AssertionError("the operator accepted the files")


def test_each_file_type_has_one_operator() -> None:
    assert drop("ball.capture.toml") == "patina.import_capture"
    for name in ("cameras.xml", "cameras.bin", "images.txt", "a.psx", "transforms.json"):
        assert drop(name) == "patina.add_files"
    assert drop("a.jpg", "b.CR2", "c.exr", "d.png") == "patina.drop_photos"


def test_only_viewports_accept_drops() -> None:
    def over(area: str | None) -> SimpleNamespace:
        scene = bpy.context.scene
        return SimpleNamespace(area=area and SimpleNamespace(type=area), scene=scene)

    for name, cls in handlers().items():  # meshes are Blender's own, but for a new capture
        assert cls.poll_drop(over("VIEW_3D")) == (name != "PATINA_FH_mesh")
        assert not cls.poll_drop(over("TEXT_EDITOR")) and not cls.poll_drop(over(None))


def test_handlers_are_registered_and_removed() -> None:
    module = extension()
    assert len(handlers()) == 4
    names = set(handlers())
    assert names <= set(dir(bpy.types))
    module.unregister()
    try:
        assert not names & set(dir(bpy.types))
    finally:
        module.register()


def test_cameras_and_photos_become_capture() -> None:
    """A COLMAP file and a folder of photos: the capture contains the values measured by hand."""
    scan = make_scan()
    settings = {
        "cameras": str(scan / "sparse" / "cameras.bin"),
        "directory": str(scan / "lit"),
        "files": files("view_01.exr", "view_03.exr"),
        "light": "DISTANT",
        "direction": (0.6, 0.0, 0.8),
    }
    assert bpy.ops.patina.new_capture(**settings) == {"FINISHED"}
    path = scan / "ball.capture.toml"
    capture = extension("core.capture").read_capture(path)
    assert [p.camera for p in capture.photos] == ["view_01.jpg", "view_03.jpg"]
    assert [p.file.resolve() for p in capture.photos] == [
        (scan / "lit" / f"view_0{k}.exr").resolve() for k in (1, 3)
    ]
    assert np.allclose(capture.lights[0].direction, (0.6, 0.0, 0.8))
    assert capture.scan.mesh.name == "mesh.ply" and capture.scan.cameras.name == "sparse"
    scene = bpy.context.scene
    assert len(scene.patina_photos.photos) == 2 and scene.patina.mesh is not None
    assert extension("scene.session.scene_properties").capture_path(scene) == str(path.resolve())
    assert bpy.ops.patina.fit.poll()


def test_every_light_is_read_back() -> None:
    new, reader = extension("core.capture.new_capture"), extension("core.capture")
    scan = make_scan(2)
    photos = sorted((scan / "lit").iterdir())
    for lamp, way in (
        (new.LampText.flash((0.1, -0.2, 0.0)), "mounted"),
        (new.LampText.sun(), "sun"),
        (new.LampText.distant((0, 0, 1)), "direction"),
    ):
        out = new.free_name(scan, "again")
        new.write_new_capture(out, scan / "sparse", scan / "mesh.ply", photos, lamp)
        assert getattr(reader.read_capture(out).lights[0], way) is not None
    assert sorted(p.name for p in scan.glob("*.toml")) == [
        "again 2.capture.toml", "again 3.capture.toml", "again.capture.toml",
    ]  # fmt: skip


def test_cameras_alone_are_imported_as_cameras() -> None:
    scan = make_scan()
    cameras = str(scan / "sparse" / "images.bin")
    assert bpy.ops.patina.new_capture(filepath=cameras) == {"FINISHED"}
    assert len([o for o in bpy.context.scene.objects if o.type == "CAMERA"]) >= 3
    assert not list(scan.glob("*.toml")) and not bpy.context.scene.patina.capture


def test_invalid_drop_reports_reason_and_leaves_nothing() -> None:
    scan = make_scan()
    (scan / "lit" / "other.exr").write_bytes((scan / "lit" / "view_01.exr").read_bytes())
    operator, before = bpy.ops.patina.new_capture, counts()
    settings = {"cameras": str(scan / "sparse"), "directory": str(scan / "lit")}
    assert "other.exr" in error_message(
        operator, **settings, files=files("view_01.exr", "other.exr")
    )
    assert "expected one" in error_message(operator, directory=settings["directory"])
    (scan / "second.ply").write_bytes((scan / "mesh.ply").read_bytes())
    assert "mesh" in error_message(operator, **settings, files=files("view_01.exr"))
    (scan / "lit" / "view_02.exr").write_bytes(b"damaged")
    mesh = str(scan / "mesh.ply")
    assert "view_02.exr" in error_message(
        operator, **settings, mesh=mesh, files=files("view_02.exr")
    )
    assert not list(scan.glob("*.toml*")) and counts() == before


def test_dropped_photos_change_nothing_until_confirmed() -> None:
    scan = make_scan()
    settings = {"directory": str(scan / "lit"), "files": files("view_01.exr", "view_02.exr")}
    path = make_capture_module().make_capture(folder() / "open", photos=2)
    bpy.ops.patina.import_capture(filepath=str(path))
    before, saved_text = counts(), path.read_text()
    assert bpy.ops.patina.drop_photos(**settings) == {"CANCELLED"}
    assert (counts(), path.read_text()) == (before, saved_text)
    assert len(bpy.context.scene.patina_photos.photos) == 2


def test_meshes_are_dropped_on_a_new_capture() -> None:
    scan = make_scan()
    bpy.ops.patina.add_files(directory=str(scan / "sparse"), files=files("cameras.bin"))
    viewport = SimpleNamespace(area=SimpleNamespace(type="VIEW_3D"), scene=bpy.context.scene)
    assert handlers()["PATINA_FH_mesh"].poll_drop(viewport)
    bpy.ops.patina.add_files(directory=str(scan), files=files("mesh.ply"))
    assert bpy.context.scene.patina_draft.mesh.endswith("mesh.ply")


def test_photos_dropped_on_open_capture_become_new_capture() -> None:
    path = make_capture_module().make_capture(folder() / "ball", photos=3)
    lit = path.parent / "more"
    lit.mkdir()
    (lit / "view_02.exr").write_bytes((path.parent / "lit_2.exr").read_bytes())
    bpy.ops.patina.import_capture(filepath=str(path))
    saved_text = path.read_text()
    settings = {"directory": str(lit), "files": files("view_02.exr"), "use": "LIT"}
    assert bpy.ops.patina.drop_photos(**settings) == {"FINISHED"}
    assert path.read_text() == saved_text
    draft = bpy.context.scene.patina_draft
    assert draft.is_open and [p.camera for p in draft.photos] == ["view_02.jpg"]
    (lit / "other.exr").write_bytes((lit / "view_02.exr").read_bytes())
    bpy.ops.patina.add_files(directory=str(lit), files=files("other.exr"))
    assert [p.name for p in draft.photos] == ["view_02.exr", "other.exr"]
    draft.photos["other.exr"].use = False
    assert bpy.ops.patina.create_capture() == {"FINISHED"}
    capture = extension("core.capture").read_capture(path.with_name("ball 2.capture.toml"))
    assert [p.camera for p in capture.photos] == ["view_02.jpg"]
    assert capture.scan.mesh.resolve() == (path.parent / "mesh.ply").resolve()
    state = extension("scene.session.running_job")
    state.set_running(state.Running(bpy.context.scene.name, "fit", "sampling", 0.5))
    try:
        assert not bpy.ops.patina.drop_photos.poll()
    finally:
        state.set_running(None)
