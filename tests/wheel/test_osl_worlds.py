"""The measured material under environment images, in a furnace, and between objects: Cycles' path
tracing against a numpy quadrature of the table and against Cycles' own closures.
"""

from __future__ import annotations

import numpy as np
import pytest

pytest.importorskip("bpy")
pytestmark = [pytest.mark.blender, pytest.mark.slow]

import bpy  # noqa: E402

from patina.core.angles import half_difference  # noqa: E402
from patina.core.appearance.energy import directional_albedo  # noqa: E402
from patina.core.appearance.principled import Principled  # noqa: E402
from patina.core.basis import PrincipalBRDF  # noqa: E402
from patina.core.varying.split import split_body  # noqa: E402
from patina.scene.export import relight  # noqa: E402
from patina.scene.material import material_nodes  # noqa: E402
from tests.projected import projected  # noqa: E402
from tests.wheel import cycles_sphere  # noqa: E402
from tests.wheel.world_light import (  # noqa: E402
    VIEW,
    assert_matches_quadrature,
    assign_material,
    lambert,
    world,
)

WORLDS = relight.shipped_worlds()

if material_nodes.osl_missing():
    pytest.skip(f"{material_nodes.osl_missing()}", allow_module_level=True)


def brdf_of(evaluate) -> PrincipalBRDF:
    return projected(evaluate, 60)


GLOSSY = Principled(base_color=np.array([0.4, 0.1, 0.05]), roughness=0.3)


SPHERES = {  # each world and each material at least once
    "glossy-interior": (GLOSSY.evaluate, "interior"),
    "glossy-sunset": (GLOSSY.evaluate, "sunset"),
    "matte-forest": (lambert, "forest"),
}


@pytest.mark.parametrize(("made", "name"), SPHERES.values(), ids=SPHERES.keys())
def test_sphere_under_environment_image(made, name, tmp_path):
    if name not in WORLDS:
        pytest.skip(f"this bpy has no world {name!r}")
    brdf = brdf_of(made)
    sphere = cycles_sphere.new_scene(size=32, samples=1024, osl=True)
    sky = world(WORLDS[name])
    node = assign_material(brdf, sphere)
    assert {s.identifier: s for s in node.inputs}["world"].default_value != ""
    assert_matches_quadrature(brdf, sky, tmp_path)


def test_white_furnace(tmp_path):
    """A surface that reflects all light is invisible in a uniform environment."""
    brdf = brdf_of(lambert)
    sphere = cycles_sphere.new_scene(size=40, samples=256, osl=True)
    bpy.context.scene.cycles.filter_width = 1.0
    cycles_sphere.sky(1.0)
    assign_material(brdf, sphere)
    image = cycles_sphere.render(tmp_path)
    normal, inside = cycles_sphere.normals()
    kept = inside & (normal @ VIEW > 0.1)
    albedo = directional_albedo(brdf.evaluate, np.arccos(np.linspace(0.2, 1, 9)))
    far = np.abs(albedo - 1).max()  # the white of the basis, not of the renderer
    assert far < 0.05
    assert abs(image[kept].mean() - 1) < far + 0.003
    assert np.abs(image[kept] - 1).max() < far + 0.05


def test_reflected_light_does_not_exceed_incident_light(tmp_path):
    brdf = brdf_of(lambda angles: 1.6 * lambert(angles))
    sphere = cycles_sphere.new_scene(size=40, samples=256, osl=True)
    bpy.context.scene.cycles.filter_width = 1.0
    cycles_sphere.sky(1.0)
    assign_material(brdf, sphere)
    image = cycles_sphere.render(tmp_path)
    normal, inside = cycles_sphere.normals()
    assert image[inside & (normal @ VIEW > 0.2)].mean() == pytest.approx(1.0, abs=0.01)


def test_interreflection_matches_diffuse_of_same_albedo(tmp_path):
    """A sphere on a floor, both matte: the measured material against Diffuse of the same albedo."""
    albedo = 0.7
    brdf = brdf_of(lambda angles: albedo * lambert(angles))
    sphere = cycles_sphere.new_scene(size=32, samples=1024, osl=True)
    bpy.context.scene.cycles.filter_width = 1.0
    cycles_sphere.sky(1.0)
    bpy.ops.mesh.primitive_plane_add(size=8, location=(0, -1, 0), rotation=(np.pi / 2, 0, 0))
    floor = bpy.context.object
    own = cycles_sphere.diffuse(albedo)
    images = []
    for measured in (False, True):
        for shape in (sphere, floor):
            if measured:
                assign_material(brdf, shape)
            else:
                shape.data.materials.clear()
                shape.data.materials.append(own)
        images.append(cycles_sphere.render(tmp_path))
    normal, inside = cycles_sphere.normals()
    low = inside & (normal @ VIEW > 0.3) & (normal[..., 1] < -0.2)  # faces the floor
    high = inside & (normal @ VIEW > 0.3) & (normal[..., 1] > 0.5)
    assert images[0][low].mean() < 0.95 * images[0][high].mean()  # the floor absorbs some light
    for part in (low, high):
        assert images[1][part].mean() == pytest.approx(images[0][part].mean(), rel=0.01)


def test_paint_scales_diffuse_part_only(tmp_path):
    brdf = brdf_of(GLOSSY.evaluate)
    light = np.array([0.6, 0.2, 0.77]) / np.linalg.norm([0.6, 0.2, 0.77])
    sphere = cycles_sphere.new_scene(size=80, osl=True)
    cycles_sphere.sun(light, 2.0)
    node = assign_material(brdf, sphere)
    body = split_body(brdf.evaluate)
    paint = np.array([0.3, 1.0, 1.5])
    sockets = {s.identifier: s for s in node.inputs}
    sockets["body"].default_value = tuple(body.body)
    sockets["body_scale"].default_value = (*paint, 1.0)
    image = cycles_sphere.render(tmp_path)
    normal, inside = cycles_sphere.normals()
    kept = inside & (normal @ light > 0.05) & (normal @ VIEW > 0.05)
    wide = [np.broadcast_to(v, normal[kept].shape) for v in (light, VIEW)]
    low, high = body.parts(brdf.evaluate(half_difference(normal[kept], *wide)))
    expected = 2.0 * (paint * low + high) * (normal[kept] @ light)[:, None]
    error = np.sqrt(np.sum((image[kept] - expected) ** 2) / np.sum(expected**2))
    assert error < 0.005
