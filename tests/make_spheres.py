"""Chrome and glossy spheres on a table under one sun, rendered by Cycles.

Needs bpy. The direction of the sun is known. The wide camera (70° field of view) sees four spheres,
all of them off its axis.
"""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

import numpy as np

from patina.core.scan import Camera, Pose

WIDTH, HEIGHT, FIELD = 960, 720, np.radians(70.0)
SUN_DIAMETER = np.radians(0.53)
# x, y on the table, radius, and what it is made of
SPHERES = (
    (-2.3, 1.9, 1.0, "chrome"),
    (2.45, 1.7, 1.0, "glossy"),
    (-1.75, -0.9, 0.75, "glossy"),
    (1.6, -1.0, 0.75, "chrome"),
)
EYE, TARGET = np.array([0.15, -4.4, 4.2]), np.array([0.1, 0.6, 0.5])


@dataclass(frozen=True)
class Shown:
    """One sphere in the picture. circle: circle fitted to its outline, (x, y, radius), pixels."""

    surface: str
    centre: np.ndarray
    radius: float
    circle: tuple[float, float, float]


def directions(count: int = 20) -> np.ndarray:
    """Return unit vectors (count, 3) surface → light, uniform from 20° above the table up."""
    place = (np.arange(count) + 0.5) / count
    up = np.sin(np.radians(20.0)) + (0.99 - np.sin(np.radians(20.0))) * place
    turn = np.arange(count) * np.pi * (3 - np.sqrt(5.0))
    flat = np.sqrt(1 - up**2)
    return np.stack([flat * np.cos(turn), flat * np.sin(turn), up], axis=1)


def camera() -> Camera:
    """Return the camera in Patina's convention (x right, y down, z forward)."""
    forward = (TARGET - EYE) / np.linalg.norm(TARGET - EYE)
    right = np.cross(forward, [0, 0, 1.0])
    right /= np.linalg.norm(right)
    rotation = np.stack([right, np.cross(forward, right), forward])
    focal = WIDTH / 2 / np.tan(FIELD / 2)
    pose = Pose(rotation, -rotation @ EYE)
    return Camera("wide", WIDTH, HEIGHT, "SIMPLE_PINHOLE", (focal, WIDTH / 2, HEIGHT / 2), pose)


def shown() -> list[Shown]:
    """Return the spheres, with the circles that a user would draw around them."""
    view = camera()
    found = []
    for x, y, radius, surface in SPHERES:
        centre = np.array([x, y, radius])
        # the points where the view's rays touch the sphere
        towards = view.pose.centre - centre
        distance = np.linalg.norm(towards)
        axis = towards / distance
        across = np.cross(axis, [0, 0, 1.0])
        across /= np.linalg.norm(across)
        turn = np.linspace(0, 2 * np.pi, 90, endpoint=False)[:, None]
        ring = np.cos(turn) * across + np.sin(turn) * np.cross(axis, across)
        ring *= np.sqrt(radius**2 * (1 - (radius / distance) ** 2))
        pixels = view.project(centre + axis * radius**2 / distance + ring)
        middle = 0.5 * (pixels.min(axis=0) + pixels.max(axis=0))
        mean = np.linalg.norm(pixels - middle, axis=1).mean()
        found.append(Shown(surface, centre, radius, (middle[0], middle[1], mean)))
    return found


def build(roughness: float = 0.05) -> None:
    """Build the scene without the sun."""
    import bpy

    from tests.wheel import cycles_sphere

    ball = cycles_sphere.new_scene()
    scene = bpy.context.scene
    # Cycles' own filter, about as wide as a sharp lens blurs: a sun within one pixel has no place
    scene.cycles.pixel_filter_type, scene.cycles.filter_width = "BLACKMAN_HARRIS", 1.5
    scene.render.use_persistent_data = True
    scene.cycles.max_bounces = 3
    scene.render.resolution_x, scene.render.resolution_y = WIDTH, HEIGHT
    cycles_sphere.sky(0.03)
    view = camera()
    lens = scene.camera
    lens.data.type, lens.data.sensor_fit, lens.data.angle = "PERSP", "HORIZONTAL", float(FIELD)
    matrix = np.eye(4)
    matrix[:3, :3] = view.pose.rotation.T @ np.diag([1, -1, -1])
    matrix[:3, 3] = view.pose.centre
    from mathutils import Matrix

    lens.matrix_world = Matrix(matrix.tolist())
    materials = {
        "chrome": _material("chrome", (0.6, 0.6, 0.6), 1.0, 0.0),
        "glossy": _material("glossy", (0.005, 0.005, 0.005), 0.0, roughness),
        "table": _material("table", (0.35, 0.3, 0.25), 0.0, 1.0),
    }
    for index, (x, y, radius, surface) in enumerate(SPHERES):
        copy = ball if index == 0 else ball.copy()
        if index:
            copy.data = ball.data.copy()
            scene.collection.objects.link(copy)
        copy.location, copy.scale = (x, y, radius), (radius, radius, radius)
        copy.data.materials.clear()
        copy.data.materials.append(materials[surface])
    bpy.ops.mesh.primitive_plane_add(size=60)
    bpy.context.object.data.materials.append(materials["table"])
    bpy.context.view_layer.update()


def _material(name: str, colour: tuple[float, float, float], metallic: float, roughness: float):
    import bpy

    material = bpy.data.materials.new(name)
    material.use_nodes = True
    node = next(n for n in material.node_tree.nodes if n.type == "BSDF_PRINCIPLED")
    node.inputs["Base Color"].default_value = (*colour, 1.0)
    node.inputs["Metallic"].default_value = metallic
    node.inputs["Roughness"].default_value = roughness
    return material


def highlight(sphere: Shown, direction: np.ndarray) -> np.ndarray:
    """Return (x, y) of the mirror image of the sun, by iteration on the half vector."""
    view = camera()
    normal = direction
    for _ in range(60):
        towards = view.pose.centre - (sphere.centre + sphere.radius * normal)
        half = towards / np.linalg.norm(towards) + direction
        normal = half / np.linalg.norm(half)
    return view.project((sphere.centre + sphere.radius * normal)[None])[0]


def picture(
    direction: np.ndarray,
    folder: Path,
    diameter: float = SUN_DIAMETER,
    samples: tuple[int, int, int] = (2, 24, 1024),
) -> np.ndarray:
    """Render (h, w, 3) linear radiance under a sun of irradiance 3.

    samples: per pixel of the picture, of the boxes around the spheres, and of the highlights. In
    highlights the sun is smaller than a pixel, so that a few dozen rays are not enough.
    """
    import bpy

    from tests.wheel import cycles_sphere

    lamp = cycles_sphere.sun(direction, 3.0)
    lamp.data.angle = float(diameter)
    settings, cycles = bpy.context.scene.render, bpy.context.scene.cycles
    cycles.samples, settings.use_border = samples[0], False
    image = cycles_sphere.render(folder)
    boxes = [(*s.circle[:2], 1.25 * s.circle[2], samples[1]) for s in shown()]
    boxes += [(*highlight(s, direction), 7.0, samples[2]) for s in shown()]
    settings.use_border, settings.use_crop_to_border = True, False
    for x, y, reach, count in boxes:
        left, right = max(round(x - reach), 0), min(round(x + reach), WIDTH)
        top, bottom = max(round(y - reach), 0), min(round(y + reach), HEIGHT)
        settings.border_min_x, settings.border_max_x = left / WIDTH, right / WIDTH
        settings.border_min_y, settings.border_max_y = 1 - bottom / HEIGHT, 1 - top / HEIGHT
        cycles.samples = count
        part = cycles_sphere.render(folder)
        image[top:bottom, left:right] = part[top:bottom, left:right]
    settings.use_border = False
    bpy.data.objects.remove(lamp)
    return image


def mask(sphere: Shown) -> np.ndarray:
    """Return (h, w) bool, whether the centre of a pixel shows the sphere."""
    view = camera()
    y, x = np.mgrid[:HEIGHT, :WIDTH] + 0.5
    rays = view.rays(np.stack([x.ravel(), y.ravel()], axis=1))
    towards = sphere.centre - view.pose.centre
    miss = np.linalg.norm(np.cross(rays, towards), axis=1)
    return (miss < sphere.radius).reshape(HEIGHT, WIDTH)
