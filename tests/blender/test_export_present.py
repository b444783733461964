"""Exports hold the materials as they are now, without what Patina draws on the mesh meanwhile."""

from __future__ import annotations

import json
from pathlib import Path

import bpy
import numpy as np
from support import extension
from test_traits import measured
from test_workflow import folder

NAME = "Glossy red"


def moved_and_exported(formats: set[str]) -> tuple[Path, np.ndarray]:
    """(folder of the export, coefficients of the changed material)."""
    material = measured()
    material.name = NAME
    material.patina_traits.every.trait_2 = 1.5
    mesh = bpy.context.scene.patina.mesh
    for name in ("Patina: residual", "Patina: camera_pose", "Patina Materials", "Own"):
        mesh.data.color_attributes.new(name, "BYTE_COLOR", "CORNER")
    brdf = extension("scene.material.trait_offsets").edited_brdf(material)
    out = folder()
    settings = {"directory": str(out), "folder": "a", "formats": formats}
    assert bpy.ops.patina.export(**settings) == {"FINISHED"}
    return out / "a", np.array(brdf.coefficients)


def test_all_formats_hold_changed_material_and_its_name() -> None:
    out, coefficients = moved_and_exported({"gltf", "blend", "mtlx", "npz", "record"})
    assert (out / "Glossy_red.mtlx").is_file() or (out / "Glossy red.mtlx").is_file()
    table = next(path for path in out.glob("*.npz") if not path.name.startswith("basis_"))
    np.testing.assert_allclose(np.load(table)["coefficients"], coefficients, rtol=1e-6)
    losses = json.loads((out / "losses.json").read_text("utf-8"))["losses"]
    assert {loss["material"] for loss in losses} == {NAME}
    glb = next(loss for loss in losses if loss["format"] == "gltf")
    subject, brdf = _principled_error(coefficients)
    stated = glb["errors"]["the Principled BSDF in Blender"]
    assert abs(stated - subject) < 0.01 * subject, "the loss is that of the material as measured"
    record = json.loads((out / "result.json").read_text("utf-8"))
    assert record["materials"][0]["name"] == "surface", "the record is that of the fit"

    bpy.ops.wm.read_homefile(use_empty=True)
    bpy.ops.import_scene.gltf(filepath=str(out / "scan.glb"))
    thing = next(o for o in bpy.data.objects if o.type == "MESH")
    assert [slot.material.name for slot in thing.material_slots] == [NAME]
    exported = thing.material_slots[0].material.node_tree.nodes["Principled BSDF"]
    colour = exported.inputs["Base Color"].default_value[:3]
    np.testing.assert_allclose(colour, brdf.principled.base_color, atol=0.01)
    names = {a.name for a in thing.data.color_attributes}
    assert not names, f"a viewer multiplies the material by the colours {names}"

    bpy.ops.wm.open_mainfile(filepath=str(out / "materials.blend"))
    asset = bpy.data.materials[NAME]
    np.testing.assert_allclose(
        np.reshape(asset["patina_coefficients"], (3, -1)), coefficients, rtol=1e-6
    )
    data = asset.asset_data
    assert {"Patina", "measured", NAME} <= {tag.name for tag in data.tags}
    assert "lit photos" in data.description and "traits changed" in data.description
    assert data.author.startswith("Patina ")
    pixels = np.array(asset.preview.image_pixels_float[:])
    assert pixels.size > 4 and pixels.std() > 0.05, "the asset has no preview"


def _principled_error(coefficients: np.ndarray):  # type: ignore[no-untyped-def]
    """(error of the Principled fitted to the changed material, that fit)."""
    basis = extension("core.basis")
    brdf = basis.PrincipalBRDF(basis.default_basis(), coefficients)
    fit = extension("core.appearance.principled_fit").fit_principled(brdf.evaluate)
    error = extension("core.export.losses").cube_root_error
    return error(fit.principled.evaluate, brdf.evaluate), fit


def test_names_that_no_file_can_have_are_cleaned() -> None:
    name = extension("scene.export.present_result").export_name
    material = bpy.data.materials.new("surface")
    material["patina_measured"] = "surface"
    other = bpy.data.materials.new("surface")
    other["patina_measured"] = "surface"
    assert other.name == "surface.001" and name(material) == name(other) == "surface"
    material.name = "red/green: 2"
    assert name(material) == "red_green_ 2"


def test_default_folder_is_never_in_the_extension() -> None:
    folders = extension("scene.session.folders")
    demo = extension("operators.import_capture").DEMO
    assert not folders.export_folder(str(demo)).resolve().is_relative_to(folders.EXTENSION)
    own = folder()
    assert folders.export_folder(str(own / "a.capture.toml")) == own
    path = folder() / "a.blend"
    bpy.ops.wm.save_as_mainfile(filepath=str(path))
    assert folders.export_folder(str(demo)) == path.parent
    assert folders.within_extension(folders.EXTENSION / "assets")


def test_export_into_the_extension_is_rejected() -> None:
    measured()
    try:
        bpy.ops.patina.export(
            directory=str(extension("scene.session.folders").EXTENSION), formats={"binary"}
        )
    except RuntimeError as error:
        assert "inside the folder of the extension" in str(error)
    else:
        raise AssertionError("it was written into the extension")
