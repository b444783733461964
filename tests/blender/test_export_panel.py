"""The measured materials of the open .blend exported with the sidebar's operator."""

from __future__ import annotations

import json
import math
import re
from pathlib import Path

import bpy
import numpy as np
from support import extension
from test_workflow import folder, make_capture_module

NUMBER = re.compile(r"-?\d+\.?\d*(?:[eE][-+]?\d+)?")


def measured():
    """A capture in the scene with the state that a fit would leave: seconds instead of a minute."""
    path = make_capture_module().make_capture(folder() / "ball", photos=2)
    assert bpy.ops.patina.import_capture(filepath=str(path)) == {"FINISHED"}
    basis = extension("core.basis").default_basis()
    entry = {
        "name": "surface",
        "estimator": "measured",
        "coefficients": basis.training[12:15].tolist(),
        "scale_known": True,
        "principled": {
            "base_color": [0.5, 0.25, 0.1], "roughness": 0.3, "diffuse_roughness": 0.4,
            "cube_root_error": 0.06, "lambertian_cube_root_error": 0.5,
        },
    }  # fmt: skip
    description = {"format": 2, "basis": {"version": basis.version}, "materials": [entry]}
    properties = extension("scene.session.scene_properties")
    properties.store_result(str(path.resolve()), {**description, "capture": str(path.resolve())})
    material = bpy.data.materials.new("surface")
    material["patina_measured"], material["patina_capture"] = "surface", str(path.resolve())
    if material.node_tree is None:
        material.use_nodes = True
    bpy.context.scene.patina.mesh.data.materials.append(material)
    return path


def fitted():
    path = make_capture_module().make_capture(
        folder() / "ball", photos=2, extra="[fit]\nheld_out = false"
    )
    assert bpy.ops.patina.import_capture(filepath=str(path)) == {"FINISHED"}
    assert bpy.ops.patina.fit() == {"FINISHED"}
    return path


def error_message(**settings) -> str:
    try:
        bpy.ops.patina.export(**settings)
    except RuntimeError as error:
        assert "Traceback" not in str(error), error
        return str(error)
    raise AssertionError("the export was not rejected")


def test_nothing_to_export_without_measured_material() -> None:
    assert not bpy.ops.patina.export.poll()
    path = make_capture_module().make_capture(folder() / "ball", photos=2)
    bpy.ops.patina.import_capture(filepath=str(path))
    assert not bpy.ops.patina.export.poll()
    assert "fit the materials first" in error_message(directory=str(folder()), formats={"binary"})


def rounded(value):
    """The same JSON with numbers of nine digits."""
    if isinstance(value, dict):
        return {key: rounded(inner) for key, inner in value.items()}
    if isinstance(value, list):
        return [rounded(inner) for inner in value]
    return float(f"{value:.9g}") if isinstance(value, float) else value


def test_tables_match_those_of_command_line() -> None:
    """Written from the .blend and by `fit` and `material`: the same bytes, but for rounding."""
    measured()
    out = folder()
    settings = {"directory": str(out), "folder": "mine", "formats": {"binary", "npz", "mtlx"}}
    assert bpy.ops.patina.export(**settings) == {"FINISHED"}
    names = {p.name for p in (out / "mine").iterdir()}
    assert {"surface.binary", "surface.npz", "surface.mtlx", "losses.txt", "losses.json"} <= names
    stored_result = json.loads(bpy.data.texts["Patina result"].as_string())
    coefficients = np.array(stored_result["materials"][0]["coefficients"])
    assert np.array_equal(np.load(out / "mine" / "surface.npz")["coefficients"], coefficients)

    record = out / "record"
    record.mkdir()
    (record / "result.json").write_text(bpy.data.texts["Patina result"].as_string())
    exporting, result = extension("core.export.material_formats"), extension("core.result")
    for _ in exporting.export_materials(
        out / "command", result.read_result(record), ["mtlx", "binary", "npz"]
    ):
        pass
    for name in names:
        ours, theirs = (out / which / name for which in ("mine", "command"))
        if name.endswith(".npz"):  # archives contain the time
            one, other = np.load(ours), np.load(theirs)
            assert all(np.array_equal(one[key], other[key]) for key in one.files)
        elif name == "losses.json":  # sums depend on the number of threads in the last digits
            assert rounded(json.loads(ours.read_text())) == rounded(json.loads(theirs.read_text()))
        elif name.endswith(".mtlx"):  # sums, as above
            texts = ours.read_text(), theirs.read_text()
            assert NUMBER.sub("#", texts[0]) == NUMBER.sub("#", texts[1])
            one, other = (np.array(NUMBER.findall(text), float) for text in texts)
            assert np.allclose(one, other, rtol=1e-6, atol=1e-9)
        else:
            assert ours.read_bytes() == theirs.read_bytes(), name


def test_mesh_export_leaves_open_file_unchanged() -> None:
    """A second Blender writes glTF and assets: the open file is neither saved nor replaced."""
    measured()
    scene, mesh = bpy.context.scene, bpy.context.scene.patina.mesh
    mesh["unsaved"] = 7
    mesh.hide_set(True)  # exporters take only visible objects
    before = bpy.data.filepath, sorted(o.name for o in scene.objects)
    out = folder()
    settings = {"directory": str(out), "folder": "a", "formats": {"gltf", "blend", "binary"}}
    assert bpy.ops.patina.export(**settings) == {"FINISHED"}
    assert (bpy.data.filepath, sorted(o.name for o in bpy.context.scene.objects)) == before
    assert bpy.context.scene.patina.mesh["unsaved"] == 7 and mesh.hide_get()
    losses = json.loads((out / "a" / "losses.json").read_text())["losses"]
    assert {loss["format"] for loss in losses} == {"gltf", "blend", "binary"}
    assert all((out / "a" / file).is_file() for loss in losses for file in loss["files"])
    assert not [p for p in out.iterdir() if p.name != "a"], "temporary files were left"

    faces = len(mesh.data.polygons)
    bpy.ops.wm.read_homefile(use_empty=True)
    bpy.ops.import_scene.gltf(filepath=str(out / "a" / "scan.glb"))
    found = next(o for o in bpy.data.objects if o.type == "MESH")
    assert len(found.data.polygons) == faces, "the scan, not a preview sphere"
    bpy.ops.wm.open_mainfile(filepath=str(out / "a" / "materials.blend"))
    assert bpy.data.materials["surface"].asset_data is not None


def test_material_without_mesh_is_exported_on_sphere() -> None:
    measured()
    bpy.data.objects.remove(bpy.context.scene.patina.mesh)
    out = folder()
    bpy.ops.patina.export(directory=str(out), folder="a", formats={"gltf"})
    assert (out / "a" / "materials.glb").is_file() and not (out / "a" / "scan.glb").exists()


def test_report_is_available_as_long_as_fit() -> None:
    path, out = fitted(), folder()
    choice, scene = extension("scene.export.export_choice"), bpy.context.scene
    assert choice.missing(scene, "report") is None
    settings = {"directory": str(out), "folder": "a", "formats": {"report", "record"}}
    assert bpy.ops.patina.export(**settings) == {"FINISHED"}
    page = (out / "a" / "report" / "index.html").read_text("utf-8")
    assert "surface" in page and path.name in page
    record = json.loads((out / "a" / "result.json").read_text())
    assert record == extension("scene.session.scene_properties").stored_result(str(path.resolve()))

    text = bpy.data.texts["Patina result"]
    stored_result, kept = json.loads(text.as_string()), text.as_string()
    stored_result["materials"][0]["coefficients"][0][0] += 0.01
    text.clear()
    text.write(json.dumps(stored_result))  # as after an undo: the .blend belongs to another fit
    assert choice.missing(scene, "report") is not None
    text.clear()
    text.write(kept)
    assert choice.missing(scene, "report") is None

    blend = folder() / "later.blend"
    bpy.ops.wm.save_as_mainfile(filepath=str(blend))
    bpy.ops.wm.open_mainfile(filepath=str(blend))
    assert "fit again" in choice.missing(bpy.context.scene, "report")
    settings["folder"] = "b"
    assert "fit again" in error_message(**settings) and not (out / "b").exists()
    settings["formats"] = {"record"}
    assert bpy.ops.patina.export(**settings) == {"FINISHED"}


def test_folder_with_other_files_is_not_overwritten() -> None:
    path = measured()
    mine = path.parent / "surface.binary"
    mine.write_bytes(b"mine")
    settings = {"directory": str(path.parent.parent), "folder": "ball", "formats": {"binary"}}
    assert (
        "not from an earlier export" in error_message(**settings) and mine.read_bytes() == b"mine"
    )
    settings["folder"] = ""
    for _ in range(2):  # again: replaced
        assert bpy.ops.patina.export(**settings) == {"FINISHED"}
    assert (path.parent.parent / "ball export" / "surface.binary").stat().st_size > 1e6


def test_formats_of_panel_are_default() -> None:
    measured()
    state, out = bpy.context.scene.patina_export, folder()
    assert state.formats == {"gltf"}
    state.formats = {"exr"}
    bpy.ops.patina.export(directory=str(out), folder="a")
    assert (out / "a" / "surface_table.exr").is_file()
    state.formats = set()
    assert "expected at least one; choose a format" in error_message(directory=str(out), folder="b")


def test_failure_of_second_blender_is_one_line() -> None:
    background = extension("scene.session.background_blender")
    errors = extension("core.errors")
    for arguments, message in (
        (["material", "/nowhere", "--to", "gltf", "--out", "/tmp/x"], "expected a result"),
        (["nonsense"], "invalid choice"),
    ):
        try:
            for step in background.in_background(arguments):
                assert 0 <= step.fraction <= 1
        except errors.PatinaError as error:
            assert message in str(error) and "\n" not in str(error)
        else:
            raise AssertionError("the second Blender did not fail")


def test_abandoned_export_leaves_no_files() -> None:
    measured()
    out = folder()
    export = extension("scene.export.export_job")
    job = export.ExportJob(bpy.context.scene, ["gltf"], out / "a", folder())
    for _ in range(8):
        assert job.step()
    assert job.now.stage and math.isfinite(job.now.fraction)
    job.close()
    assert list(out.iterdir()) == []


def test_selected_formats_can_be_saved_as_preset() -> None:
    preset_formats, name = bpy.context.scene.patina_export, "patina test of presets"
    preset_formats.formats = {"usd", "binary"}
    assert bpy.ops.patina.add_export_preset(name=name) == {"FINISHED"}
    folders = bpy.utils.preset_paths("patina/export")
    file = next(f for f in Path(folders[-1]).glob("*.py") if "test_of_presets" in f.name)
    try:
        preset_formats.formats = {"gltf"}
        bpy.ops.script.execute_preset(filepath=str(file), menu_idname="PATINA_PT_export_presets")
        assert preset_formats.formats == {"usd", "binary"}
    finally:
        file.unlink()
    for operator in ("new_capture", "solve_photos"):
        rna = getattr(bpy.ops.patina, operator).get_rna_type()
        kept = {p.identifier for p in rna.properties if not p.is_skip_preset} - {"rna_type"}
        assert kept in ({"light", "offset", "direction"}, {"lens", "threads"}), kept
