"""Materials that vary: Fit shows them as maps packed in the .blend, and removes them again."""

from __future__ import annotations

import json

import bpy
import numpy as np
from support import extension
from test_workflow import check_few_pixels, folder, make_capture_module

FACTORS = {"scale", "roughness scale", "specular scale"}
DIFFUSE = np.array([0.16, 0.05, 0.04])  # 1/sr, of the material that make_capture uses


def bands(normal: np.ndarray, light: np.ndarray, view: np.ndarray) -> np.ndarray:
    """A coated sphere with stripes across its x axis."""
    stripes = 0.6 * np.sign(np.sin(9 * normal[..., :1]))
    return make_capture_module().blinn(normal, light, view) + DIFFUSE * stripes


def half_metal(normal: np.ndarray, light: np.ndarray, view: np.ndarray) -> np.ndarray:
    """A Blinn–Phong metal on the upper half, a matt red paint on the lower."""
    half = light + view
    half = half / np.linalg.norm(half, axis=-1, keepdims=True)
    lobe = np.clip(np.sum(normal * half, axis=-1), 0, 1)[..., None] ** 40
    metal = lobe * np.array([1.9, 1.5, 1.1]) + 0.004
    return np.where(normal[..., 2:] > 0, metal, DIFFUSE + 0.02 * lobe)


def imported(name: str, photos: int = 6, **more: object) -> None:
    fit = "[fit]\nheld_out = false"
    path = make_capture_module().make_capture(folder() / name, photos=photos, extra=fit, **more)
    assert bpy.ops.patina.import_capture(filepath=str(path)) == {"FINISHED"}


def images(material: bpy.types.Material) -> dict[str, bpy.types.Image]:
    """Label of its node → image."""
    return {n.label: n.image for n in material.node_tree.nodes if n.type == "TEX_IMAGE"}


def pixels(image: bpy.types.Image) -> np.ndarray:
    return np.array(image.pixels[:]).reshape(*reversed(image.size), 4)[..., :3]


def exported_files_have_the_variation() -> None:
    """glTF has maps; tables state that they lose the variation; the record has its file."""
    out = folder()
    formats = {"gltf", "npz", "record"}
    settings = {"directory": str(out), "folder": "a", "formats": formats}
    assert bpy.ops.patina.export(**settings) == {"FINISHED"}
    assert (out / "a" / "varying.npz").is_file()
    losses = json.loads((out / "a" / "losses.json").read_text())["losses"]
    lost = {loss["format"]: any("variation" in one for one in loss["dropped"]) for loss in losses}
    assert lost == {"gltf": False, "npz": True}
    data = (out / "a" / "scan.glb").read_bytes()
    header = json.loads(data[20 : 20 + int.from_bytes(data[12:16], "little")])
    assert "baseColorTexture" in header["materials"][0]["pbrMetallicRoughness"]


def mesh_shows_the_variation() -> None:
    """Vertices of bright stripes are red, those of dark stripes blue; a second press ends it."""
    mesh = bpy.context.scene.patina.mesh.data
    layer = mesh.color_attributes["Patina surface: diffuse"]
    rgba = np.empty(4 * len(mesh.vertices), np.float32)
    layer.data.foreach_get("color_srgb", rgba)
    points = np.empty(3 * len(mesh.vertices), np.float32)
    mesh.vertices.foreach_get("co", points)
    x = points.reshape(-1, 3)[:, 0] - make_capture_module().CENTRE[0]
    red, _, blue, _ = rgba.reshape(-1, 4).T
    seen = red + blue > 0.3
    inside = seen & (np.abs(np.sin(9 * x)) > 0.5)
    assert inside.mean() > 0.3
    assert np.mean((red > blue)[inside] == (np.sin(9 * x) > 0)[inside]) > 0.9
    assert bpy.ops.patina.show_variation(kind="diffuse") == {"FINISHED"}
    assert mesh.color_attributes.active_color.name == "Patina surface: diffuse"
    overlay = extension("scene.views.evidence_overlay")
    assert overlay.legend("Patina surface: diffuse")[1] == ("half", "typical", "twice")
    assert len(overlay.scale_colours("Patina surface: error", 3)) == 3
    assert bpy.ops.patina.show_variation(kind="diffuse") == {"FINISHED"}
    assert extension("scene.session.overlay_shading").overlay_shown() == ""


def test_painted_sphere_gets_maps_and_even_fit_removes_them() -> None:
    imported("bands", brdf=bands)
    settings = bpy.context.scene.patina
    assert settings.varying == "auto"
    assert bpy.ops.patina.fit() == {"FINISHED"}
    material = bpy.data.materials["surface"]
    found = images(material)
    assert {"scale", "roughness scale", "base color"} <= found.keys()
    assert all(image.packed_file is not None for image in found.values())
    scale = pixels(found["scale"])
    low, high = np.percentile(scale, (20, 80))
    assert high > 2 * low, "the stripes differ by a factor of four"
    lobes = extension("scene.material.measured_nodes").lobe_node(material)
    assert lobes.inputs["Diffuse Scale"].is_linked
    principled = extension("scene.material.measured_nodes").principled_node(material)
    assert principled.inputs["Base Color"].is_linked
    for script in extension("scene.material.osl_files").script_nodes(material):
        linked = {s.identifier for s in script.inputs if s.is_linked}
        assert {"body_scale", "roughness_scale"} <= linked
    mesh = settings.mesh.data
    uv = np.empty(2 * len(mesh.loops), np.float32)
    mesh.uv_layers.active.uv.foreach_get("vector", uv)
    assert np.ptp(uv) > 0.5
    bpy.context.scene.patina_photos.active = 1
    assert bpy.ops.patina.look_at_photo(kind="comparison") == {"FINISHED"}
    view = extension("scene.views.photo_comparison")._last.value
    assert view.typical < 0.1, "the prediction has the stripes"
    mesh_shows_the_variation()
    exported_files_have_the_variation()
    blend = str(folder() / "bands.blend")
    bpy.ops.wm.save_as_mainfile(filepath=blend)
    bpy.ops.wm.open_mainfile(filepath=blend)
    again = pixels(images(bpy.data.materials["surface"])["scale"])
    np.testing.assert_allclose(again, scale, atol=1e-6)
    bpy.context.scene.patina.varying = "never"
    assert bpy.ops.patina.fit() == {"FINISHED"}
    assert not images(bpy.data.materials["surface"])
    maps = [i for i in bpy.data.images if "patina_map" in i]
    assert not maps, "packed maps of the earlier fit are removed"
    colours = bpy.context.scene.patina.mesh.data.color_attributes
    assert not [a.name for a in colours if a.name.startswith("Patina surface")]
    assert not bpy.ops.patina.show_variation.poll()


def test_even_sphere_has_no_maps() -> None:
    imported("even")
    assert bpy.ops.patina.fit() == {"FINISHED"}
    assert not images(bpy.data.materials["surface"])


def test_maps_are_undone_with_the_fit() -> None:
    imported("bands", brdf=bands)
    bpy.ops.ed.undo_push(message="imported")
    bpy.context.scene.patina.varying = "always"
    assert bpy.ops.patina.fit() == {"FINISHED"}
    bpy.ops.ed.undo_push(message="fitted")
    assert images(bpy.data.materials["surface"])
    bpy.ops.ed.undo()
    assert "surface" not in bpy.data.materials or not images(bpy.data.materials["surface"])


def test_check_keeps_the_variation() -> None:
    imported("bands", brdf=bands)
    check_few_pixels()
    scene = bpy.context.scene
    assert images(bpy.data.materials["surface"])
    assert bpy.ops.patina.show_variation.poll()
    for cause in scene.patina.causes:
        cause.use = False
    assert bpy.ops.patina.refit() == {"FINISHED"}
    assert images(bpy.data.materials["surface"])


def test_metal_and_paint_become_two_materials() -> None:
    imported("halves", 8, brdf=half_metal)
    assert bpy.ops.patina.fit() == {"FINISHED"}
    scene = bpy.context.scene
    mesh = scene.patina.mesh.data
    assert [m.name for m in mesh.materials] == ["surface_1", "surface_2"]
    assert "surface" not in bpy.data.materials
    count = len(mesh.polygons)
    slot, centre = np.empty(count, np.int32), np.empty(3 * count, np.float32)
    mesh.polygons.foreach_get("material_index", slot)
    mesh.polygons.foreach_get("center", centre)
    up = centre.reshape(-1, 3)[:, 2] - make_capture_module().CENTRE[2]
    seen = np.abs(up) < 0.6  # the cameras stand around the sphere
    agree = np.mean((slot == 1) == (up > 0), where=seen)
    assert max(agree, 1 - agree) > 0.9
    result = extension("scene.session.scene_properties").stored_result(scene.patina.capture)
    assert result["varying"]["separated_from"] == "surface"
    scene.patina_photos.active = 1
    assert bpy.ops.patina.look_at_photo(kind="comparison") == {"FINISHED"}
    out = folder()
    settings = {"directory": str(out), "folder": "a", "formats": {"gltf", "record"}}
    assert bpy.ops.patina.export(**settings) == {"FINISHED"}
    header = (out / "a" / "result.json").read_text("utf-8")
    assert "surface_2" in header
