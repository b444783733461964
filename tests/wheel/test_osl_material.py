"""The OSL material in Cycles, against the numpy BRDF that it was made from."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

pytest.importorskip("bpy")
pytestmark = [pytest.mark.blender, pytest.mark.slow]

import bpy  # noqa: E402

from patina.core.angles import Angles, half_difference  # noqa: E402
from patina.core.appearance.principled import Principled  # noqa: E402
from patina.core.appearance.principled_fit import fit_principled  # noqa: E402
from patina.core.basis import PrincipalBRDF, default_basis  # noqa: E402
from patina.core.brdf import nbrdf  # noqa: E402
from patina.scene.material import (  # noqa: E402
    fallback,
    lamp_inputs,
    material_nodes,
    osl_files,
    world_inputs,
)
from tests.projected import projected  # noqa: E402
from tests.wheel import cycles_sphere  # noqa: E402

VIEW = np.array([0.0, 0.0, 1.0])
LIGHT = np.array([0.6, 0.2, 0.77]) / np.linalg.norm([0.6, 0.2, 0.77])
MATERIALS = [("analytic", 5), ("dark-red-paint", 5), ("alum-bronze", 10), ("pink-fabric", 20),
             ("gold-metallic-paint", 100)]  # fmt: skip
EXTRA_MATERIALS = [("chrome", 100), ("steel", 100), ("white-fabric", 100), ("fruitwood-241", 100),
        ("green-latex", 100), ("blue-acrylic", 100), ("black-phenolic", 100)]  # fmt: skip

if material_nodes.osl_missing():
    pytest.skip(f"{material_nodes.osl_missing()}", allow_module_level=True)


def _brdf(name: str, count: int, shared: Path | None) -> PrincipalBRDF:
    """A material projected onto the basis; 'analytic' is a rough glossy Principled."""
    if name == "analytic":
        evaluate = Principled(base_color=np.array([0.4, 0.1, 0.05]), roughness=0.35).evaluate
    else:
        names, weights = nbrdf.load(shared / "data" / "brdf" / "nbrdf_merl.npz")

        def evaluate(angles: Angles) -> np.ndarray:
            return nbrdf.evaluate(weights[names.index(name)], angles)

    return projected(evaluate, count)


@pytest.fixture(params=MATERIALS, ids=lambda m: f"{m[0]}-{m[1]}")
def brdf(request) -> PrincipalBRDF:
    name, count = request.param
    return _brdf(name, count, None if name == "analytic" else request.getfixturevalue("shared"))


def _material(brdf: PrincipalBRDF, sphere: bpy.types.Object) -> bpy.types.Material:
    fit = fit_principled(brdf.evaluate)
    files = osl_files.ensure_files(brdf)
    material = material_nodes.create_material("measured", brdf, fit, files)
    assert material_nodes.NO_OSL_REASON not in material
    sphere.data.materials.clear()
    sphere.data.materials.append(material)
    return material


def _expected(brdf: PrincipalBRDF, light: np.ndarray) -> np.ndarray:
    """Radiance per irradiance, (h, w, 3), for directions to the light (…, 3)."""
    normal, _ = cycles_sphere.normals()
    light, view = np.broadcast_to(light, normal.shape), np.broadcast_to(VIEW, normal.shape)
    cos_i = np.einsum("...i,...i->...", normal, light)
    return brdf.evaluate(half_difference(normal, light, view)) * np.maximum(cos_i, 0)[..., None]


def _relative_rms(image: np.ndarray, expected: np.ndarray) -> float:
    return float(np.sqrt(np.sum((image - expected) ** 2) / np.sum(expected**2)))


@pytest.mark.parametrize("named", [*MATERIALS, *EXTRA_MATERIALS], ids=lambda m: f"{m[0]}-{m[1]}")
def test_rendering_under_sun(named, request, tmp_path):
    """From the highlight to grazing light and view, from matte to mirror."""
    name, count = named
    brdf = _brdf(name, count, None if name == "analytic" else request.getfixturevalue("shared"))
    sphere = cycles_sphere.new_scene(size=120, osl=True)
    cycles_sphere.sun(LIGHT, 2.0)
    _material(brdf, sphere)
    image = cycles_sphere.render(tmp_path)
    normal, inside = cycles_sphere.normals()
    kept = inside & (normal @ LIGHT > 0.01) & (normal @ VIEW > 0.05)
    expected = 2.0 * _expected(brdf, LIGHT)
    assert _relative_rms(image[kept], expected[kept]) < 0.005
    grazing = kept & (normal @ LIGHT < 0.2)
    assert _relative_rms(image[grazing], expected[grazing]) < 0.01
    assert np.all(image[inside & (normal @ LIGHT < -0.01)] == 0)


def test_other_object_casts_shadow(tmp_path):
    """Lit where Cycles' own diffuse surface is lit, and nowhere else."""
    sphere = cycles_sphere.new_scene(size=80, osl=True)
    cycles_sphere.sun(LIGHT, 2.0)
    bpy.ops.mesh.primitive_cube_add(size=0.5, location=tuple(1.6 * LIGHT))
    bpy.context.object.visible_camera = False
    sphere.data.materials.append(cycles_sphere.diffuse(1.0))
    lambert = cycles_sphere.render(tmp_path)
    brdf = _brdf("analytic", 5, None)
    _material(brdf, sphere)
    image = cycles_sphere.render(tmp_path)
    normal, inside = cycles_sphere.normals()
    kept = inside & (normal @ LIGHT > 0.05) & (normal @ VIEW > 0.05)
    lit = lambert[..., 0] > 0
    assert 0.05 < np.mean(~lit[kept]) < 0.6
    expected = 2.0 * _expected(brdf, LIGHT)
    # rays may hit a shadow's edge one pixel apart
    wrong = np.abs(image - np.where(lit[..., None], expected, 0)).max(axis=-1) > 0.01
    assert np.mean(wrong[kept]) < 0.01
    assert np.mean(image[kept & ~lit] == 0) > 0.97


def test_rendering_under_uniform_sky(brdf, tmp_path):
    sphere = cycles_sphere.new_scene(size=48, samples=300, osl=True)
    bpy.context.scene.cycles.filter_width = 1.0
    cycles_sphere.sky(1.0)
    _material(brdf, sphere)
    image = cycles_sphere.render(tmp_path)
    normal, inside = cycles_sphere.normals()
    # nearer to the rim the cosine changes too much within a pixel
    kept = inside & (normal @ VIEW > 0.4)
    cosines = np.linspace(0.4, 1, 13)
    table = np.array([_albedo(brdf, mu) for mu in cosines])
    expected = np.stack([np.interp(normal[kept][:, 2], cosines, t) for t in table.T], axis=-1)
    np.testing.assert_allclose(image[kept].mean(axis=0), expected.mean(axis=0), rtol=0.005)


def _albedo(brdf: PrincipalBRDF, mu: float) -> np.ndarray:
    """∫ρ cosθi dωi (3,) for view cosine mu, by quadrature over half vectors, fine near n."""
    view = np.array([np.sqrt(1 - mu * mu), 0.0, mu])
    knee, n_t, n_p = 0.01, 160, 60
    span = np.log1p(np.pi / 2 / knee)
    theta = knee * np.expm1((np.arange(n_t) + 0.5) / n_t * span)
    step = (theta + knee) * span / n_t * 2 * np.pi / n_p
    t, p = np.meshgrid(theta, (np.arange(n_p) + 0.5) / n_p * 2 * np.pi, indexing="ij")
    half = np.stack([np.sin(t) * np.cos(p), np.sin(t) * np.sin(p), np.cos(t)], axis=-1)
    cos_d = half @ view
    light = 2 * cos_d[..., None] * half - view
    weight = np.sin(t) * step[:, None] * 4 * cos_d * light[..., 2]
    kept = (light[..., 2] > 0) & (cos_d > 0)
    wide = np.broadcast_to(view, light[kept].shape)
    normal = np.broadcast_to(VIEW, wide.shape)
    return np.sum(brdf.evaluate(half_difference(normal, light[kept], wide)) * weight[kept][:, None],
                  axis=0)  # fmt: skip


LAMPS = {
    "point": ("POINT", {"shadow_soft_size": 0.0}),
    "spot": ("SPOT", {"shadow_soft_size": 0.0, "spot_size": 0.6, "spot_blend": 0.4}),
    "small area": ("AREA", {"size": 0.01}),
}


@pytest.mark.parametrize("kind", LAMPS)
def test_other_lamp_types_give_irradiance_of_diffuse_surface(kind, tmp_path):
    """Cycles' own diffuse BSDF gives the irradiance, so that no unit of Patina is assumed."""
    lamp_type, settings = LAMPS[kind]
    sphere = cycles_sphere.new_scene(size=48, osl=True)
    lamp = bpy.data.lights.new(kind, lamp_type)
    lamp.energy = 100.0
    for name, value in settings.items():
        setattr(lamp, name, value)
    lamp_object = cycles_sphere.sun(np.array([2.0, 1.0, 3.0]))
    lamp_object.data, lamp_object.location = lamp, (2.0, 1.0, 3.0)
    lamp_object.visible_camera = False
    brdf = _brdf("analytic", 5, None)
    _material(brdf, sphere)
    image = cycles_sphere.render(tmp_path)
    sphere.data.materials[0] = cycles_sphere.diffuse(1.0)
    lambert = cycles_sphere.render(tmp_path) * np.pi  # E cosθ
    normal, inside = cycles_sphere.normals()
    light = np.array([2.0, 1.0, 3.0]) - normal
    light /= np.linalg.norm(light, axis=-1, keepdims=True)
    cos_i = np.einsum("...i,...i->...", normal, light)
    expected = _expected(brdf, light) * lambert / np.maximum(cos_i, 1e-3)[..., None]
    kept = inside & (cos_i > 0.2) & (normal @ VIEW > 0.2)
    assert expected[kept].max() > 0
    assert _relative_rms(image[kept], expected[kept]) < 0.01


def test_shader_outputs_and_visible_inputs():
    sphere = cycles_sphere.new_scene(osl=True)
    material = _material(_brdf("analytic", 5, None), sphere)
    outputs = {n.target: n for n in material.node_tree.nodes if n.type == "OUTPUT_MATERIAL"}
    assert set(outputs) == {"ALL", "CYCLES"}
    assert outputs["ALL"].is_active_output and not outputs["CYCLES"].is_active_output
    source = {k: n.inputs["Surface"].links[0].from_node.type for k, n in outputs.items()}
    assert source == {"ALL": "BSDF_PRINCIPLED", "CYCLES": "SCRIPT"}
    (node,) = osl_files.script_nodes(material)
    shown = [s.name for s in node.inputs if not s.hide]
    assert [s for s in shown if s.startswith("Coefficient")] == [
        f"Coefficient {i}" for i in range(1, 6)
    ]
    assert not [s for s in shown if s.startswith("Lamp")]


def test_files_are_restored_when_blend_is_moved(tmp_path):
    sphere = cycles_sphere.new_scene(osl=True)
    brdf = _brdf("analytic", 5, None)
    first, second = tmp_path / "first", tmp_path / "second"
    first.mkdir()
    second.mkdir()
    bpy.ops.wm.save_as_mainfile(filepath=str(first / "a.blend"))
    _material(brdf, sphere)
    files = osl_files.ensure_files(brdf).paths
    assert {path.parent for path in files.values()} == {first} and len(files) == 3
    bpy.ops.wm.save_mainfile()
    (first / "a.blend").rename(second / "a.blend")
    original = {socket: path.read_bytes() for socket, path in files.items()}
    for path in files.values():
        path.unlink()
    bpy.ops.wm.open_mainfile(filepath=str(second / "a.blend"))
    assert osl_files.restore() == []
    (node,) = osl_files.script_nodes(bpy.data.materials["measured"])
    for socket in osl_files.file_sockets(node):
        path = Path(socket.default_value)
        assert path.parent == second and path.read_bytes() == original.pop(socket.identifier)
    assert not original


def test_material_stores_all_coefficients():
    sphere = cycles_sphere.new_scene(osl=True)
    basis = default_basis()
    c = np.random.default_rng(0).normal(0, 0.03, (3, 100))
    material = _material(PrincipalBRDF(basis, c), sphere)
    kept = np.array(material[material_nodes.COEFFICIENTS]).reshape(3, -1)
    np.testing.assert_array_equal(kept, c)
    assert material[material_nodes.BASIS_VERSION] == basis.version
    (node,) = osl_files.script_nodes(material)
    shown = [s for s in node.inputs if s.name.startswith("Coefficient")]
    np.testing.assert_allclose([tuple(s.default_value) for s in shown], c[:, :8].T, rtol=1e-6)


def test_changed_coefficient_changes_rendering(tmp_path):
    sphere = cycles_sphere.new_scene(size=80, osl=True)
    cycles_sphere.sun(LIGHT, 2.0)
    c = np.random.default_rng(1).normal(0, 0.03, (3, 30))
    material = _material(PrincipalBRDF(default_basis(), c), sphere)
    (node,) = osl_files.script_nodes(material)
    moved = c.copy()
    moved[:, 1] += (0.03, 0.0, -0.02)
    node.inputs["coefficient_2"].default_value = tuple(moved[:, 1])
    image = cycles_sphere.render(tmp_path)
    normal, inside = cycles_sphere.normals()
    kept = inside & (normal @ LIGHT > 0.1) & (normal @ VIEW > 0.1)
    expected = 2.0 * _expected(PrincipalBRDF(default_basis(), moved), LIGHT)[kept]
    assert _relative_rms(image[kept], expected) < 0.003


def test_replaced_material_leaves_no_image():
    sphere = cycles_sphere.new_scene(osl=True)
    names = []
    for seed in range(2):
        c = np.random.default_rng(seed).normal(0, 0.03, (3, 10))
        material = _material(PrincipalBRDF(default_basis(), c), sphere)
        names.append(material[osl_files.PROPERTIES["remainder"]])
        if seed == 0:
            sphere.data.materials.clear()
            bpy.data.materials.remove(material)
    osl_files.drop_unused()
    assert names[1] in bpy.data.images and names[0] not in bpy.data.images


def test_portable_material_is_used_where_osl_is_off(tmp_path):
    sphere = cycles_sphere.new_scene(osl=True)
    scene = bpy.context.scene
    cycles_sphere.sun(LIGHT, 2.0)
    material = _material(_brdf("analytic", 5, None), sphere)

    def leads() -> str:
        outputs = {n.target: n for n in material.node_tree.nodes if n.type == "OUTPUT_MATERIAL"}
        return outputs["CYCLES"].inputs["Surface"].links[0].from_node.type

    assert leads() == "SCRIPT" and fallback.osl_hindrance(scene) is None
    scene.cycles.shading_system = False
    assert "Open Shading Language" in fallback.osl_hindrance(scene)
    assert fallback.update_fallback(scene) == 1 and leads() == "BSDF_PRINCIPLED"
    assert cycles_sphere.render(tmp_path).max() > 0.05  # not black
    scene.cycles.shading_system = True
    assert fallback.update_fallback(scene) == 1 and leads() == "SCRIPT"
    assert fallback.update_fallback(scene) == 0
    scene.render.engine = "BLENDER_WORKBENCH"
    assert "another render engine" in fallback.osl_hindrance(scene)


def test_handlers_are_registered_and_removed():
    groups = ("load_post", "save_post", "depsgraph_update_post", "render_pre")
    before = {g: list(getattr(bpy.app.handlers, g)) for g in groups}
    modules = (osl_files, lamp_inputs, world_inputs, fallback)
    for module in modules:
        module.register()
    added = {g: len(getattr(bpy.app.handlers, g)) - len(before[g]) for g in groups}
    expected = {"load_post": 3, "save_post": 1, "depsgraph_update_post": 3, "render_pre": 3}
    assert added == expected
    for module in reversed(modules):
        module.unregister()
    assert {g: list(getattr(bpy.app.handlers, g)) for g in groups} == before


def test_without_osl_portable_material_is_made_and_reported(monkeypatch):
    sphere = cycles_sphere.new_scene(osl=True)
    monkeypatch.setattr(material_nodes, "osl_missing", lambda: "no OSL here")
    brdf = _brdf("analytic", 5, None)
    files = osl_files.ensure_files(brdf)
    material = material_nodes.create_material("plain", brdf, fit_principled(brdf.evaluate), files)
    sphere.data.materials.append(material)
    assert material[material_nodes.NO_OSL_REASON] == "no OSL here"
    assert [n.target for n in material.node_tree.nodes if n.type == "OUTPUT_MATERIAL"] == ["ALL"]
