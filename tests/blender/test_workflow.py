"""From files to a material on the mesh, with the operators that a user presses."""

from __future__ import annotations

import functools
import importlib.util
import json
import sys
import tempfile
from pathlib import Path

import bpy
import numpy as np
from bpy_extras.object_utils import world_to_camera_view
from mathutils import Vector
from support import ROOT, extension


def make_capture_module():
    """tests/make_capture.py, which does not depend on the extension."""
    name = "make_capture"
    if name not in sys.modules:
        spec = importlib.util.spec_from_file_location(name, ROOT / "tests" / "make_capture.py")
        sys.modules[name] = importlib.util.module_from_spec(spec)
        spec.loader.exec_module(sys.modules[name])
    return sys.modules[name]


def folder() -> Path:
    return Path(tempfile.mkdtemp(prefix="patina-test-"))


def counts() -> dict[str, int]:
    kinds = (
        "objects",
        "meshes",
        "cameras",
        "lights",
        "materials",
        "images",
        "collections",
        "texts",
    )
    return {kind: len(getattr(bpy.data, kind)) for kind in kinds}


def lenses():
    """(model, parameters, width, height): off-centre, portrait, distorted, non-square pixels."""
    yield "SIMPLE_PINHOLE", (900.0, 500.0, 350.0), 1000, 700
    yield "SIMPLE_PINHOLE", (900.0, 431.7, 388.2), 1000, 700
    yield "PINHOLE", (1500.0, 1500.0, 300.3, 610.9), 700, 1000
    yield "SIMPLE_PINHOLE", (2400.0, 2010.0, 1498.0), 4000, 3000
    yield "SIMPLE_RADIAL", (900.0, 480.0, 360.0, -0.08), 1000, 700
    yield "OPENCV", (1100.0, 1090.0, 330.0, 520.0, -0.1, 0.02, 0.001, -0.002), 700, 1000
    yield "PINHOLE", (1100.0, 1080.0, 510.0, 340.0), 1000, 700
    yield "OPENCV_FISHEYE", (700.0, 702.0, 505.0, 345.0, 0.01, -0.003, 0.0, 0.0), 1000, 700


def test_camera_projection_matches_pycolmap() -> None:
    """Blender's projection against pycolmap's, over the whole frame: < 0.01 px."""
    core, scene_cameras = extension("core.scan"), extension("scene.photos.cameras")
    rng = np.random.default_rng(0)
    scene = bpy.context.scene
    worst = 0.0
    for (model, parameters, width, height), (rotation, translation) in zip(
        lenses(), make_capture_module().poses(8), strict=True
    ):
        camera = core.Camera(
            f"{model}-{width}", width, height, model, parameters,
            core.Pose(rotation, translation),
        )  # fmt: skip
        seen = camera if camera.pinhole else camera.rectified()
        stood = scene_cameras.create_camera(camera, np.zeros(3), 3.0, scene.collection)
        scene_cameras.look_through(scene, stood)
        bpy.context.view_layer.update()
        pixels = rng.uniform((0, 0), (width, height), (400, 2))
        pixels[:4] = [(0, 0), (width, 0), (0, height), (width, height)]
        points = camera.pose.centre + seen.rays(pixels) * rng.uniform(2, 9, (400, 1))
        expected = seen.project(points)
        assert np.abs(expected - pixels).max() < 1e-6
        for point, there in zip(points, expected, strict=True):
            view = world_to_camera_view(scene, stood, Vector(point))
            here = np.array([view.x * width, (1 - view.y) * height])
            worst = max(worst, float(np.abs(here - there).max()))
    print(f"     largest difference {worst:.5f} px")
    assert worst < 0.01


def test_rectified_photos_match_pinhole_projection() -> None:
    """A resampled photo of a distorted lens: a dot lands where the pinhole camera projects its
    point.
    """
    core, rectified = extension("core.scan"), extension("core.geometry.rectify")
    rotation, translation = next(iter(make_capture_module().poses(1)))
    camera = core.Camera(
        "x",
        400,
        300,
        "SIMPLE_RADIAL",
        (350.0, 190.0, 160.0, -0.12),
        core.Pose(rotation, translation),
    )
    target = camera.rectified()
    for x, y in ((40.0, 30.0), (200.0, 150.0), (350.0, 250.0)):
        rows, columns = np.indices((300, 400)) + 0.5
        dot = np.exp(-((columns - x) ** 2 + (rows - y) ** 2) / 18.0)[..., None] * np.ones(3)
        out = rectified.rectify(dot.astype(np.float32), camera, target)[..., 0]
        found = np.array([(out * columns).sum(), (out * rows).sum()]) / out.sum()
        point = camera.pose.centre + camera.rays(np.array([[x, y]])) * 4.0
        assert np.abs(found - target.project(point)[0]).max() < 0.05


def test_import_builds_scene() -> None:
    path = make_capture_module().make_capture(folder() / "ball", photos=4)
    bpy.context.scene.patina_orientation.up_axis = "Z"  # suns are compared with the file
    assert bpy.ops.patina.import_capture(filepath=str(path)) == {"FINISHED"}
    scene = bpy.context.scene
    mesh = scene.patina.mesh
    assert mesh is not None and len(mesh.data.polygons) == 20 * 4**5
    stood = [o for o in scene.objects if o.type == "CAMERA" and "patina_lit" in o]
    suns = [o for o in scene.objects if o.type == "LIGHT" and "patina_light" in o]
    assert len(stood) == len(suns) == 4
    for camera in stood:
        background = camera.data.background_images[0]
        assert background.frame_method == "CROP"
        assert tuple(background.image.size) == (
            make_capture_module().WIDTH,
            make_capture_module().HEIGHT,
        )
    for sun, direction in zip(
        sorted(suns, key=lambda o: o.name), make_capture_module().light_directions(4), strict=True
    ):
        bpy.context.view_layer.update()
        assert np.allclose(sun.matrix_world.to_3x3().col[2], direction, atol=1e-5)
        assert np.isclose(sun.data.energy, make_capture_module().IRRADIANCE)
    assert scene.camera in stood
    first = scene.camera
    bpy.ops.patina.next_photo()
    assert scene.camera in stood and scene.camera != first


def test_invalid_capture_gives_one_message_and_no_scene() -> None:
    path = make_capture_module().make_capture(folder() / "ball", photos=2)
    path.write_text(path.read_text().replace("lit_2.exr", "gone.exr"))
    before = counts()
    try:
        bpy.ops.patina.import_capture(filepath=str(path))
    except RuntimeError as error:
        assert "photo 2.file" in str(error) and "gone.exr" in str(error)
        assert "Traceback" not in str(error)
    else:
        raise AssertionError("a missing photo was accepted")
    assert counts() == before


def test_fit_operator_matches_api() -> None:
    path = make_capture_module().make_capture(folder() / "ball", photos=4)
    bpy.ops.patina.import_capture(filepath=str(path))
    assert bpy.ops.patina.fit() == {"FINISHED"}
    stored_result = json.loads(bpy.data.texts["Patina result"].as_string())
    job = extension("core.jobs").FitJob(extension("core.capture").read_capture(path))
    job.drain()
    expected = job.result.materials[0].fit.brdf.coefficients
    assert np.array_equal(np.array(stored_result["materials"][0]["coefficients"]), expected)

    mesh = bpy.context.scene.patina.mesh
    assert [m.name for m in mesh.data.materials] == ["surface"]
    tree = mesh.data.materials[0].node_tree
    portable = next(
        n for n in tree.nodes if n.bl_idname == "ShaderNodeOutputMaterial" and n.target == "ALL"
    )
    assert portable.is_active_output
    assert portable.inputs["Surface"].links[0].from_node.bl_idname == "ShaderNodeBsdfPrincipled"
    measured = [n for n in tree.nodes if n.bl_idname == "ShaderNodeScript"]
    if extension("scene.material.material_nodes").osl_missing() is None:
        assert measured and measured[0].outputs[0].links[0].to_node.target == "CYCLES"
        names = [s.name for s in measured[0].inputs]
        assert "Coefficient 1" in names and "Coefficient 6" in names
    else:
        assert not measured and "patina_without_osl" in mesh.data.materials[0]

    check_proposed_photo(stored_result["proposed_photo"])
    before = counts()
    bpy.ops.patina.fit()  # again: replaces, does not accumulate
    assert counts()["materials"] == before["materials"]
    assert "Proposed Lamp" not in bpy.data.objects, "the arrow of the fit before is removed"


def check_proposed_photo(photo: dict) -> None:
    """The operator selects the camera and points an arrow from the lamp at the turned mesh."""
    mesh = bpy.context.scene.patina.mesh
    mesh.rotation_euler = (0.4, 0.0, 0.9)
    bpy.context.view_layer.update()
    for _ in range(2):  # the arrow moves, it does not accumulate
        assert bpy.ops.patina.show_proposed_photo() == {"FINISHED"}
    bpy.context.view_layer.update()
    camera = bpy.context.view_layer.objects.active
    assert camera.type == "CAMERA" and camera["patina_label"] == photo["camera"]
    (arrow,) = [o for o in bpy.data.objects if o.name.startswith("Proposed Lamp")]
    assert camera.select_get() and arrow.select_get() and arrow.hide_render
    turned = np.array(mesh.matrix_world)[:3, :3] @ photo["towards_light"]
    pointing = np.array(arrow.matrix_world)[:3, 2]  # an arrow points along +Z
    assert np.allclose(pointing, -turned, atol=1e-5)
    corners = np.array([mesh.matrix_world @ Vector(corner) for corner in mesh.bound_box])
    away = np.array(arrow.location) - corners.mean(axis=0)
    assert np.allclose(away / np.linalg.norm(away), turned, atol=1e-5)
    mesh.rotation_euler = (0.0, 0.0, 0.0)


def test_demo_by_operator_equals_demo_by_api() -> None:
    """The embedded capture: coefficients, samples and held-out photos to the last digit."""
    assert bpy.ops.patina.import_demo() == {"FINISHED"}
    assert bpy.ops.patina.fit() == {"FINISHED"}
    stored_result = json.loads(bpy.data.texts["Patina result"].as_string())
    demo = extension("operators.import_capture").DEMO
    job = extension("core.jobs").FitJob(
        extension("core.capture").read_capture(demo), portable=False
    )
    job.drain()
    assert [m["name"] for m in stored_result["materials"]] == ["glaze", "clay"]
    for written, fitted in zip(stored_result["materials"], job.result.materials, strict=True):
        assert np.array_equal(np.array(written["coefficients"]), fitted.fit.brdf.coefficients)
        assert sum(written["samples"]["per_photo"].values()) == sum(fitted.per_photo) > 1000
        assert written["held_out"]["typical"] == fitted.held_out.typical


def check_few_pixels() -> None:
    """Check with an eighth of the pixels: numpy of some Blender versions is slow."""
    operator = extension("operators.check")
    usual = operator.CheckJob
    operator.CheckJob = functools.partial(usual, pixels=3000)
    try:
        assert bpy.ops.patina.check() == {"FINISHED"}
    finally:
        operator.CheckJob = usual


def test_check_names_light_drift_and_fit_can_include_or_skip_it() -> None:
    path = make_capture_module().make_capture(folder() / "ball", photos=4)
    capture_text = path.read_text()
    path.write_text(
        capture_text.replace('file = "lit_2.exr"', 'file = "lit_2.exr"\nexposure = 1.5')
    )
    bpy.ops.patina.import_capture(filepath=str(path))
    assert not bpy.ops.patina.refit.poll()  # not checked yet
    check_few_pixels()
    stored = extension("scene.session.scene_properties").stored_result
    kind, mine = extension("scene.session.scene_properties").DIAGNOSIS, str(path.resolve())
    diagnosis, fit = stored(mine, kind), stored(mine)
    assert diagnosis["named"][0] == "light_intensity"
    assert diagnosis["applied"] == [e["cause"] for e in fit["effects"]]
    gains = [v["value"] for v in diagnosis["causes"][0]["parameters"].values()]
    truth = -np.log([1, 1.5, 1, 1])
    off = np.abs(gains - (truth - truth.mean())).max()
    assert off < 0.08, (off, gains)  # four photos, each with its own light: gain or BRDF?
    assert diagnosis["extended"]["held_out"] < diagnosis["baseline"]["held_out"]

    scene, mesh = bpy.context.scene, bpy.context.scene.patina.mesh
    layer = mesh.data.color_attributes["Patina: residual"]
    assert len(layer.data) == len(mesh.data.vertices)
    for name in ("residual", "light_intensity"):
        assert bpy.ops.patina.show_evidence(cause=name) == {"FINISHED"}
        assert mesh.data.color_attributes.active_color.name == f"Patina: {name}"

    assert [c.name for c in scene.patina.causes if c.use] == diagnosis["applied"]
    assert scene.patina.causes[0].name == "light_intensity"
    for cause in scene.patina.causes:
        cause.use = False
    assert bpy.ops.patina.refit() == {"FINISHED"}
    without = stored(mine)
    assert without["effects"] == [] and stored(mine, kind)["applied"] == []
    one, other = (f["materials"][0]["coefficients"] for f in (fit, without))
    assert np.abs(np.subtract(one, other)).max() > 1e-3
    assert mesh.data.materials[0]["patina_measured"] == "surface"
    for name in ("Patina diagnosis", "Patina result"):
        assert len([t for t in bpy.data.texts if t.name.startswith(name)]) == 1


def test_results_survive_saving_and_loading() -> None:
    path = make_capture_module().make_capture(folder() / "ball", photos=3)
    bpy.ops.patina.import_capture(filepath=str(path))
    bpy.ops.patina.fit()
    blend = folder() / "saved.blend"
    bpy.ops.wm.save_as_mainfile(filepath=str(blend))
    bpy.ops.wm.read_homefile(use_factory_startup=True)
    bpy.ops.wm.open_mainfile(filepath=str(blend))
    scene = bpy.context.scene
    assert scene.patina.capture == str(path)
    assert scene.patina.mesh.data.materials[0]["patina_measured"] == "surface"
    stored_result = extension("scene.session.scene_properties").stored_result(str(path.resolve()))
    assert stored_result["materials"][0]["name"] == "surface"


def test_georeferenced_scans_keep_their_precision() -> None:
    """The same ball 500 km from the origin: Blender's float32 would be off by centimetres."""
    core, frame = extension("core.scan"), extension("scene.scan.origin")
    vertices, faces = make_capture_module().sphere_mesh(4)
    far = np.array([500_000.0, 4_000_000.0, 120.0])
    mesh = core.Mesh(vertices + far, faces.astype(np.int32))
    origin = frame.frame_origin(mesh.vertices)
    assert np.abs(origin - far).max() < 2
    target = extension("scene.scan.meshes").create_mesh_object(
        "far", mesh, origin, bpy.context.scene.collection
    )
    found = np.empty(3 * len(vertices), np.float32)
    target.data.vertices.foreach_get("co", found)
    assert np.abs(found.reshape(-1, 3) - (vertices + far - origin)).max() < 1e-6
    assert (frame.frame_origin(vertices) == 0).all()


def test_two_captures_keep_their_materials_apart() -> None:
    """The same material name in two captures: fitting one must not change the other."""
    red = make_capture_module().make_capture(
        folder() / "red", photos=2, extra="[fit]\nheld_out = false"
    )
    green = make_capture_module().make_capture(
        folder() / "green",
        photos=2,
        extra="[fit]\nheld_out = false",
        brdf=lambda normal, light, view: make_capture_module().blinn(normal, light, view)[
            :, [1, 0, 2]
        ],
    )
    objects = []
    for path in (red, green):
        bpy.ops.patina.import_capture(filepath=str(path))
        bpy.ops.patina.fit()
        objects.append(bpy.context.scene.patina.mesh)
    first, second = (o.data.materials[0] for o in objects)
    assert first != second
    colour = [
        next(n for n in m.node_tree.nodes if n.bl_idname == "ShaderNodeBsdfPrincipled")
        .inputs["Base Color"].default_value[:2]
        for m in (first, second)
    ]  # fmt: skip
    assert colour[0][0] > colour[0][1] and colour[1][1] > colour[1][0]
    stored = extension("scene.session.scene_properties").stored_result
    assert stored(str(red.resolve())) and stored(str(green.resolve()))


def test_capture_is_imported_once_and_again_after_deletion() -> None:
    path = make_capture_module().make_capture(folder() / "ball", photos=2)
    bpy.ops.patina.import_capture(filepath=str(path))
    before = counts()
    try:
        bpy.ops.patina.import_capture(filepath=str(path))
    except RuntimeError as error:
        assert "already in the scene" in str(error)
    else:
        raise AssertionError("the same capture was imported twice")
    assert counts() == before
    bpy.data.objects.remove(bpy.context.scene.patina.mesh)
    assert bpy.ops.patina.import_capture(filepath=str(path)) == {"FINISHED"}


def test_lamp_follows_photo() -> None:
    path = make_capture_module().make_capture(folder() / "ball", photos=3)
    bpy.ops.patina.import_capture(filepath=str(path))
    scene = bpy.context.scene
    for _ in range(4):
        shining = [
            o["patina_light"] for o in scene.objects if "patina_light" in o and o.type == "LIGHT"
            and not o.hide_render
        ]  # fmt: skip
        assert shining == [scene.camera["patina_light"]]
        bpy.ops.patina.next_photo()


def test_faces_get_their_material_in_edit_mode() -> None:
    path = make_capture_module().make_capture(
        folder() / "ball", photos=3,
        extra='[[material]]\nname = "low"\nfaces = "part"\n[[material]]\nname = "high"\n'
        'faces = "part"\n[fit]\nheld_out = false',
    )  # fmt: skip
    vertices, faces = make_capture_module().sphere_mesh()
    high = vertices[faces].mean(axis=1)[:, 2] > make_capture_module().CENTRE[2]
    make_capture_module().write_ply(path.parent / "mesh.ply", vertices, faces, high.astype(int))
    bpy.ops.patina.import_capture(filepath=str(path))
    mesh = bpy.context.scene.patina.mesh
    bpy.ops.object.mode_set(mode="EDIT")
    bpy.ops.patina.fit()
    assert mesh.mode == "OBJECT"
    index = np.empty(len(mesh.data.polygons), np.int32)
    mesh.data.polygons.foreach_get("material_index", index)
    assert np.array_equal(index, high)


def test_fit_without_mesh_reports_it() -> None:
    path = make_capture_module().make_capture(
        folder() / "ball", photos=2, extra="[fit]\nheld_out = false"
    )
    bpy.ops.patina.import_capture(filepath=str(path))
    bpy.data.objects.remove(bpy.context.scene.patina.mesh)
    job = extension("core.jobs").FitJob(extension("core.capture").read_capture(path))
    job.drain()
    notes = extension("scene.scan.apply_result").apply_result(
        bpy.context.scene, job.result, job.stages
    )
    assert any("not in this scene" in note for note in notes)


def test_running_fit_is_not_saved() -> None:
    state, path = extension("scene.session.running_job"), folder() / "running.blend"
    state.set_running(state.Running(bpy.context.scene.name, "fit", "sampling the photos", 0.5))
    assert state.running(bpy.context.scene) is not None
    bpy.ops.wm.save_as_mainfile(filepath=str(path))
    state.set_running(None)
    bpy.ops.wm.open_mainfile(filepath=str(path))
    assert state.running(bpy.context.scene) is None
