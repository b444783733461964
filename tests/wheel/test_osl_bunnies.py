"""The measured material on a whole object: the bunny under environment images, and two bunnies that
face each other.
"""

from __future__ import annotations

import numpy as np
import pytest

pytest.importorskip("bpy")
pytestmark = [pytest.mark.blender, pytest.mark.slow]

import bpy  # noqa: E402

from patina.core.appearance.principled import Principled  # noqa: E402
from patina.core.geometry import RayScene  # noqa: E402
from patina.core.scan import Mesh  # noqa: E402
from patina.core.scan.mesh import read_mesh  # noqa: E402
from patina.scene.export import relight  # noqa: E402
from patina.scene.material import material_nodes  # noqa: E402
from tests.projected import projected  # noqa: E402
from tests.wheel import cycles_sphere  # noqa: E402
from tests.wheel.world_light import (  # noqa: E402
    VIEW,
    assign_material,
    directions,
    lambert,
    reflected,
    world,
)

SIZE = 48  # of the environment images
SEEDS = 4
PIXELS = 20  # that are compared, inside and outside the ball's shadow
BALL = (np.array([0.9, 0.9, 0.9]), 0.45)  # black ball: centre and radius
GLOSSY = Principled(base_color=np.array([0.4, 0.1, 0.05]), roughness=0.3)
WORLDS = relight.shipped_worlds()

if material_nodes.osl_missing():
    pytest.skip(f"{material_nodes.osl_missing()}", allow_module_level=True)


@pytest.fixture
def bunny(shared) -> Mesh:
    """The exact surface, scaled into a unit sphere around the origin."""
    mesh = read_mesh(shared / "data" / "scans" / "bunny_truth.ply")
    vertices = mesh.vertices - (mesh.vertices.max(axis=0) + mesh.vertices.min(axis=0)) / 2
    return Mesh(vertices / np.linalg.norm(vertices, axis=1).max(), mesh.faces)


def put(mesh: Mesh, bunny_object: bpy.types.Object | None = None) -> bpy.types.Object:
    """Add the mesh as a smooth object of the scene, or replace the mesh of another object."""
    data = bpy.data.meshes.new("bunny")
    data.from_pydata(mesh.vertices, [], mesh.faces)
    data.shade_smooth()
    if bunny_object is not None:
        bunny_object.data = data
        return bunny_object
    bunny_object = bpy.data.objects.new("bunny", data)
    bpy.context.scene.collection.objects.link(bunny_object)
    return bunny_object


def seen_at_pixels(rays: RayScene, bunny_object: bpy.types.Object) -> tuple[np.ndarray, ...]:
    """(n, 2) pixels that show the mesh, (n, 3) its points there and Blender's smooth normals."""
    u = ((np.arange(SIZE) + 0.5) / SIZE * 2 - 1) * cycles_sphere.HALF_WIDTH
    x, y = np.meshgrid(u, -u)
    starts = np.stack([x, y, np.full_like(x, 5.0)], axis=-1).reshape(-1, 3)
    hits = rays.first_hits(starts, np.broadcast_to(-VIEW, starts.shape))
    hit = hits.face >= 0
    hits = type(hits)(*(a[hit] for a in hits))
    smooth = np.empty(3 * len(bunny_object.data.vertices), np.float32)
    bunny_object.data.vertex_normals.foreach_get("vector", smooth)
    corners = smooth.reshape(-1, 3)[rays.mesh.faces[hits.face]].astype(float)
    shares = np.stack([1 - hits.u - hits.v, hits.u, hits.v], axis=1)[..., None]
    normals = np.sum(shares * corners, axis=1)
    normals /= np.linalg.norm(normals, axis=1, keepdims=True)
    return np.stack(np.divmod(np.flatnonzero(hit), SIZE), axis=1), rays.points(hits), normals


def behind_ball(point: np.ndarray, towards: np.ndarray) -> np.ndarray:
    """Whether rays from one or more points along unit directions (..., 3) hit the ball."""
    centre, radius = BALL
    along = np.sum(towards * (centre - point), axis=-1)
    nearest2 = np.sum((centre - point) ** 2, axis=-1) - along**2
    return (along > 0) & (nearest2 < radius**2)


CASES = {  # test_osl_worlds.py renders spheres in all worlds, in less time
    "glossy-interior": (GLOSSY.evaluate, "interior"),
}


def hidden_by_itself(rays: RayScene, point: np.ndarray, normal: np.ndarray, towards: np.ndarray):
    """Whether the mesh itself occludes directions (h, w, 3) above the surface."""
    up = towards @ normal > 0
    hidden = np.zeros(up.shape, bool)
    start = np.broadcast_to(point + 2e-4 * normal, (int(up.sum()), 3))
    hidden[up] = rays.occluded(start, towards[up])
    return hidden


@pytest.mark.parametrize("made, name", CASES.values(), ids=CASES.keys())
def test_bunny_under_environment_image(made, name, bunny, tmp_path):
    """Compared where it does not see itself, which would need path tracing; a black ball casts a
    shadow on it.
    """
    if name not in WORLDS:
        pytest.skip(f"this bpy has no world {name!r}")
    brdf = projected(made, 60)
    bunny_object = put(bunny, cycles_sphere.new_scene(size=SIZE, samples=1024, osl=True))
    # a box filter covers the pixel whatever its width; the bunny is not smooth across one
    bpy.context.scene.cycles.pixel_filter_type = "BLACKMAN_HARRIS"
    sky = world(WORLDS[name])
    assign_material(brdf, bunny_object)
    bpy.ops.mesh.primitive_uv_sphere_add(
        segments=256, ring_count=128, radius=BALL[1], location=BALL[0]
    )
    bpy.context.object.data.materials.append(cycles_sphere.diffuse(0.0))
    images = []
    for seed in range(SEEDS):
        bpy.context.scene.cycles.seed = seed
        images.append(cycles_sphere.render(tmp_path))

    rays = RayScene.build(bunny)
    towards, solid = directions(sky)
    pixels, points, normals = seen_at_pixels(rays, bunny_object)
    facing = np.flatnonzero((normals @ VIEW > 0.3) & ~behind_ball(points, VIEW))
    rows, expected, shadowed = [], [], []
    for k in np.random.default_rng(3).permutation(facing):
        few = towards[::8, ::8]
        if hidden_by_itself(rays, points[k], normals[k], few).mean() > 0.005:
            continue
        cosine = np.maximum(towards @ normals[k], 0)
        itself = hidden_by_itself(rays, points[k], normals[k], towards)
        if np.sum((cosine * solid)[itself]) > 0.002 * np.pi:
            continue
        ball = behind_ball(points[k], towards)
        dark = np.sum((cosine * solid)[ball]) > 0.05 * np.pi
        if sum(s == dark for s in shadowed) == PIXELS // 2:
            continue
        rows.append(pixels[k])
        shadowed.append(dark)
        expected.append(reflected(brdf, np.where((ball | itself)[..., None], 0, sky), normals[k]))
        if len(rows) == PIXELS:
            break
    assert len(rows) == PIXELS
    at = tuple(np.array(rows).T)
    found = np.array([image[at] for image in images])
    noise = np.sqrt(np.mean(found.var(axis=0, ddof=1)) / SEEDS)
    error, mean = found.mean(axis=0) - expected, np.mean(expected)
    assert noise < 0.03 * mean
    # errors of a pixel's three channels are correlated: they are not three independent draws
    assert abs(error.mean()) < 0.003 * mean + 3 * noise / np.sqrt(PIXELS)
    assert np.sqrt(np.mean(error**2)) < 1.5 * noise + 0.003 * mean


def test_interreflection_of_two_bunnies_matches_diffuse(bunny, tmp_path):
    """Light is exchanged between them as between two objects with Cycles' own Diffuse."""
    albedo = 0.7
    brdf = projected(lambda angles: albedo * lambert(angles), 60)
    sphere = cycles_sphere.new_scene(size=SIZE, samples=1024, osl=True)
    bpy.context.scene.cycles.filter_width = 1.0
    cycles_sphere.sky(1.0)
    pair = []
    for side in (-1, 1):
        vertices = 0.7 * bunny.vertices
        vertices[:, 0] = side * (vertices[:, 0].max() + 0.02 - vertices[:, 0])
        faces = bunny.faces if side < 0 else bunny.faces[:, ::-1]
        mesh = Mesh(vertices, np.ascontiguousarray(faces))
        pair.append(put(mesh, sphere if side < 0 else None))
    own = cycles_sphere.diffuse(albedo)
    images = {}
    for measured in (False, True):
        for bunny_object in pair:
            bunny_object.data.materials.clear()
            bunny_object.data.materials.append(own)
        if measured:
            assign_material(brdf, *pair)
        images[measured] = cycles_sphere.render(tmp_path)
    bpy.context.scene.cycles.max_bounces = 0
    for bunny_object in pair:
        bunny_object.data.materials.clear()
        bunny_object.data.materials.append(own)
    direct = cycles_sphere.render(tmp_path)
    # alone in a white environment each would be `albedo`; interreflection lies between it and
    # `direct`
    on_it = (images[False] < 0.95).all(axis=-1)
    deep = on_it & (direct.mean(axis=-1) < 0.75 * albedo)
    assert deep.sum() > 20
    assert images[False][deep].mean() > 1.2 * direct[deep].mean()
    for part in (on_it, deep):
        assert images[True][part].mean() == pytest.approx(images[False][part].mean(), rel=0.01)
