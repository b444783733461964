"""The capture's lights as Blender lamps: Cycles gives a white diffuse sphere the radiance E·cos θ/π
that core predicts, and each lamp stands at the light's position.
"""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

pytest.importorskip("bpy")
pytestmark = pytest.mark.blender

import bpy  # noqa: E402

from patina.core.light import DistantLight, Light, MountedLight, NearLight  # noqa: E402
from patina.core.scan.camera import Camera, Pose  # noqa: E402
from patina.scene.photos import lamps  # noqa: E402
from patina.scene.photos.cameras import create_camera  # noqa: E402
from patina.scene.property_keys import CAPTURE  # noqa: E402
from tests.make_capture import look_at  # noqa: E402
from tests.wheel import cycles_sphere  # noqa: E402

COLOUR = np.array([3.0, 2.0, 0.5])
ORIGIN = np.array([2000.0, -300.0, 40.0])
EYE = np.array([0.9, -0.7, 2.1])


def _camera(eye: np.ndarray = EYE) -> Camera:
    """Looks past the sphere's centre: a beam's axis is not the line to the centre."""
    rotation, translation = look_at(eye + ORIGIN, np.array([0.3, 0.2, 0.1]) + ORIGIN)
    return Camera(
        "a", 400, 300, "SIMPLE_PINHOLE", (500.0, 200.0, 150.0), Pose(rotation, translation)
    )


def _rendered(light: Light, folder: Path, samples: int = 1) -> np.ndarray:
    """The white diffuse unit sphere under a light's lamp; (h, w, 3) radiance."""
    sphere = cycles_sphere.new_scene(size=48, samples=samples)
    scene = bpy.context.scene
    scene.cycles.max_bounces = 0
    white = bpy.data.materials.new("white")
    white.use_nodes = True
    tree = white.node_tree
    tree.nodes.clear()
    matte = tree.nodes.new("ShaderNodeBsdfDiffuse")
    matte.inputs["Color"].default_value = (1, 1, 1, 1)
    output = tree.nodes.new("ShaderNodeOutputMaterial")
    tree.links.new(matte.outputs[0], output.inputs["Surface"])
    sphere.data.materials.append(white)
    lamp = lamps.create_lamp(light, ORIGIN, np.zeros(3), 2.0, scene.collection)
    camera = create_camera(_camera(), ORIGIN, 2.0, scene.collection)
    camera["patina_light"], lamp[CAPTURE], camera[CAPTURE] = light.name, "x", "x"
    lamps.shine_only(scene, camera)
    return cycles_sphere.render(folder)


def _predicted(light: Light) -> tuple[np.ndarray, np.ndarray]:
    """(radiance (h, w, 3), (h, w) pixels well inside the lit part)."""
    normals, inside = cycles_sphere.normals()
    points = normals[inside]
    found = light.incidence(points + ORIGIN, _camera())
    cosine = np.einsum("ij,ij->i", found.towards, points)
    radiance = np.zeros(normals.shape)
    radiance[inside] = found.irradiance * np.maximum(cosine, 0)[:, None] / np.pi
    lit = np.zeros(inside.shape, bool)
    lit[inside] = (cosine > 0.25) & (points[:, 2] > 0.1)
    return radiance, lit


LIGHTS = [
    DistantLight("sun", np.array([0.48, -0.36, 0.8]), COLOUR),
    NearLight("lamp", ORIGIN + np.array([1.1, 0.9, 1.6]), COLOUR),
    MountedLight("flash", np.array([0.5, -0.3, 0.2]), COLOUR),
    MountedLight("beam", np.array([0.5, -0.3, 0.2]), COLOUR, beam=np.radians(18.0)),
    MountedLight("wide", np.array([-0.1, 0.0, -0.4]), COLOUR, beam=np.radians(140.0)),
]


@pytest.mark.parametrize("light", LIGHTS, ids=lambda light: light.name)
def test_cycles_irradiance_matches_core(light: Light, tmp_path: Path) -> None:
    image = _rendered(light, tmp_path)
    radiance, lit = _predicted(light)
    assert lit.sum() > 300
    assert radiance[lit].max() > 1.5 * radiance[lit].min()  # otherwise any constant would pass
    error = np.abs(image[lit] / radiance[lit] - 1)
    print(f"{light.name}: largest {error.max():.5f}, median {np.median(error):.6f}")
    assert error.max() < 0.01
    assert np.median(error) < 0.001


EXTENDED_LIGHTS = [
    DistantLight("sun", np.array([0.48, -0.36, 0.8]), COLOUR, np.radians(3.0)),
    NearLight("lamp", ORIGIN + np.array([1.1, 0.9, 1.6]), COLOUR, 0.25),
    MountedLight("flash", np.array([0.5, -0.3, 0.2]), COLOUR, 0.25),
]


@pytest.mark.parametrize("light", EXTENDED_LIGHTS, ids=lambda light: light.name)
def test_extended_source_gives_same_irradiance_where_fully_visible(
    light: Light, tmp_path: Path
) -> None:
    """A ball of uniform radiance gives I/d² whatever its radius."""
    image = _rendered(light, tmp_path, samples=64)
    radiance, lit = _predicted(light)
    # several rays per pixel: exclude pixels at the edge
    lit &= cycles_sphere.normals()[0][..., 2] > 0.5
    ratio = image[lit].sum() / radiance[lit].sum()
    print(f"{light.name}: {ratio:.5f}")
    assert abs(ratio - 1) < 0.002
    data = bpy.data.objects[light.name].data
    if isinstance(light, DistantLight):
        assert np.isclose(data.angle, np.radians(6.0))
    else:
        assert np.isclose(data.shadow_soft_size, 0.25)


@pytest.mark.parametrize("far", [0.0, 4_000_000.0])
def test_flash_lamp_is_at_its_camera_offset(far: float) -> None:
    """On every camera, also of a georeferenced scan, also after the user unparented it."""
    bpy.ops.wm.read_homefile(use_factory_startup=True)
    scene, origin = bpy.context.scene, np.array([far, -far / 8, 40.0])
    light = MountedLight("flash", np.array([0.31, -0.17, 0.05]), COLOUR, beam=0.6)
    lamp = lamps.create_lamp(light, origin, np.zeros(3), 2.0, scene.collection)
    lamp[CAPTURE] = "x"
    rng = np.random.default_rng(1)
    made = []
    for label in "abcdef":
        rotation, translation = look_at(rng.uniform(-3, 3, 3) + origin, origin)
        camera = Camera(label, 400, 300, "SIMPLE_PINHOLE", (500.0, 200.0, 150.0),
                        Pose(rotation, translation))  # fmt: skip
        made.append((camera, create_camera(camera, origin, 3.0, scene.collection)))
        made[-1][1][CAPTURE], made[-1][1]["patina_light"] = "x", "flash"
    for turn, (camera, stood) in enumerate(made * 2):
        lamps.shine_only(scene, stood)
        bpy.context.view_layer.update()
        here = np.array(lamp.matrix_world.translation)
        assert np.abs(here + origin - light.position(camera)).max() < 2e-6 + 2e-9 * far
        axis = -np.array(lamp.matrix_world.to_3x3().col[2])  # a lamp shines along its −Z
        assert np.allclose(axis, camera.pose.rotation[2], atol=1e-6)
        graph = bpy.context.evaluated_depsgraph_get()
        nodes = lamp.evaluated_get(graph).data.node_tree.nodes
        along = next(n for n in nodes if n.type == "VECT_MATH")
        assert np.allclose(along.inputs[1].default_value, camera.pose.rotation[2], atol=1e-6)
        if turn == 7:  # Clear Parent and Keep Transformation
            world = lamp.matrix_world.copy()
            lamp.parent = None
            lamp.matrix_world = world
