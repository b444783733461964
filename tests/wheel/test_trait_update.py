"""A measured material whose trait sliders were changed, rendered in Cycles."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np
import pytest

pytest.importorskip("bpy")
pytestmark = [pytest.mark.blender, pytest.mark.slow]

import bpy  # noqa: E402

from patina.core.angles import half_difference  # noqa: E402
from patina.core.appearance.principled_fit import fit_principled  # noqa: E402
from patina.core.appearance.traits import ShiftableAlbedo, excess  # noqa: E402
from patina.core.basis import PrincipalBRDF, default_basis  # noqa: E402
from patina.core.views import prepared_materials  # noqa: E402
from patina.scene.material import (  # noqa: E402
    material_nodes,
    osl_files,
    trait_offsets,
    trait_properties,
    trait_update,
)
from patina.scene.scan.apply_result import MEASURED_NAME  # noqa: E402
from tests.wheel import cycles_sphere  # noqa: E402

LIGHT = np.array([0.6, 0.2, 0.77]) / np.linalg.norm([0.6, 0.2, 0.77])
VIEW = np.array([0.0, 0.0, 1.0])

if material_nodes.osl_missing():
    pytest.skip(f"{material_nodes.osl_missing()}", allow_module_level=True)


@pytest.fixture(autouse=True)
def sliders(monkeypatch) -> Iterator[None]:
    """Registers the sliders, with cheap fits of the portable models: Cycles does not show those."""

    def quick(evaluate):
        return fit_principled(evaluate, coat=False, nodes=(10, 4, 3))

    monkeypatch.setattr(prepared_materials, "fit_principled", quick)
    trait_properties.register()
    trait_update.register()
    yield
    trait_update.unregister()
    trait_properties.unregister()


def _material(sphere: bpy.types.Object) -> bpy.types.Material:
    coefficients = np.random.default_rng(1).normal(0, 0.03, (3, 30))
    brdf = PrincipalBRDF(default_basis(), coefficients)
    fit = fit_principled(brdf.evaluate, coat=False, nodes=(10, 4, 3))
    made = material_nodes.create_material("moved", brdf, fit, osl_files.ensure_files(brdf))
    made[MEASURED_NAME] = "moved"
    sphere.data.materials.append(made)
    return made


def test_cycles_shows_shifted_brdf_before_and_after_other_models_update(tmp_path):
    sphere = cycles_sphere.new_scene(size=80, osl=True)
    cycles_sphere.sun(LIGHT, 2.0)
    material = _material(sphere)
    (node,) = osl_files.script_nodes(material)
    inputs = {socket.identifier: socket for socket in node.inputs}
    table = inputs["sampling"].default_value
    material.patina_traits.every.trait_1 = -0.8
    material.patina_traits.every.trait_4 = 0.6
    material.patina_traits.green.trait_2 = 0.5
    normal, inside = cycles_sphere.normals()
    kept = inside & (normal @ LIGHT > 0.1) & (normal @ VIEW > 0.1)
    light, view = np.broadcast_to(LIGHT, normal.shape), np.broadcast_to(VIEW, normal.shape)
    rho = trait_offsets.edited_brdf(material).evaluate(half_difference(normal, light, view))
    expected = (2.0 * rho * (normal @ LIGHT)[..., None])[kept]
    scale = np.sqrt(np.mean(expected**2))
    # the render would wait for the other models
    bpy.app.handlers.render_pre.remove(trait_update._in_background)
    before = cycles_sphere.render(tmp_path)[kept]
    assert inputs["sampling"].default_value == table
    bpy.app.handlers.render_pre.append(trait_update._in_background)
    after = cycles_sphere.render(tmp_path)[kept]
    assert inputs["sampling"].default_value != table, "a render in the background waits for it"
    for image in (before, after):
        assert np.sqrt(np.mean((image - expected) ** 2)) / scale < 0.005


def test_impossible_shift_is_limited_to_incident_light(tmp_path):
    sphere = cycles_sphere.new_scene(size=48, samples=200, osl=True)
    cycles_sphere.sky(1.0)
    material = _material(sphere)
    material.patina_traits.every.trait_2 = -4.0
    albedo = ShiftableAlbedo.of(trait_offsets.measured_brdf(material)).at(
        trait_offsets.shifts(material)
    )
    assert excess(albedo)[0] > 1.5
    trait_update.finish_updates()
    image = cycles_sphere.render(tmp_path)
    normal, inside = cycles_sphere.normals()
    kept = inside & (normal @ VIEW > 0.4)
    assert image[kept].mean(axis=0).max() < 1.02
    assert image[kept].max(axis=-1).mean() > 0.95, "limited to the incident light, not darker"
