"""Objects with the measured material under an environment image, and their expected radiance: the
sum over every pixel of that image.
"""

from __future__ import annotations

from pathlib import Path
from typing import Protocol

import bpy
import numpy as np
import OpenImageIO as oiio

from patina.core.angles import Angles, half_difference
from patina.core.appearance.principled_fit import fit_principled
from patina.core.basis import PrincipalBRDF
from patina.scene.export import relight
from patina.scene.material import material_nodes, osl_files
from tests.wheel import cycles_sphere

VIEW = np.array([0.0, 0.0, 1.0])  # the camera of cycles_sphere
PIXELS = 24  # that are compared, in every environment


class Evaluated(Protocol):
    """A BRDF, or a model of one."""

    def evaluate(self, angles: Angles) -> np.ndarray: ...


def lambert(angles: Angles) -> np.ndarray:
    """ρ of a white diffuser."""
    return np.full((angles.theta_h.size, 3), 1 / np.pi)


def assign_material(brdf: PrincipalBRDF, *objects: bpy.types.Object) -> bpy.types.Node:
    """Assign the measured material to objects; return its script node."""
    files = osl_files.ensure_files(brdf)
    fit = fit_principled(brdf.evaluate, coat=False, nodes=(12, 6, 4))
    material = material_nodes.create_material("measured", brdf, fit, files)
    assert material_nodes.NO_OSL_REASON not in material
    for thing in objects:
        thing.data.materials.clear()
        thing.data.materials.append(material)
    (node,) = osl_files.script_nodes(material)
    return node


def world(path: Path) -> np.ndarray:
    """Light the scene by an environment image; return its (h, w, 3) radiance, zenith in row 0."""
    relight.light_with(bpy.context.scene, path)
    return np.asarray(oiio.ImageBuf(str(path)).get_pixels(oiio.FLOAT), np.float64)[..., :3]


def directions(sky: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """(h, w, 3) towards each pixel of an environment by Cycles' mapping, and (h, w) sr of each."""
    h, w = sky.shape[:2]
    down = (np.arange(h) + 0.5) / h * np.pi
    around = (0.5 - (np.arange(w) + 0.5) / w) * 2 * np.pi
    t, p = np.meshgrid(down, around, indexing="ij")
    towards = np.stack([np.sin(t) * np.cos(p), np.sin(t) * np.sin(p), np.cos(t)], axis=-1)
    return towards, (2 * np.pi / w) * 2 * np.sin(t) * np.sin(np.pi / h / 2)


def reflected(brdf: Evaluated, sky: np.ndarray, normal: np.ndarray) -> np.ndarray:
    """(3,) Σ ρ L cos θi dω over all pixels of the environment, towards VIEW."""
    towards, solid = directions(sky)
    cos_i = towards @ normal
    up = cos_i > 0
    wide = towards[up]
    angles = half_difference(
        np.broadcast_to(normal, wide.shape), wide, np.broadcast_to(VIEW, wide.shape)
    )
    weight = (cos_i[up] * solid[up])[:, None] * sky[up]
    return np.sum(brdf.evaluate(angles) * weight, axis=0)


def assert_matches_quadrature(brdf: Evaluated, sky: np.ndarray, folder: Path) -> None:
    """Render the sphere of the scene twice, and compare pixels of it with ``reflected``: their mean
    and their RMS error, within what the noise between both renders allows."""
    images = []
    for seed in (1, 2):
        bpy.context.scene.cycles.seed = seed
        images.append(cycles_sphere.render(folder))
    normal, inside = cycles_sphere.normals()
    rows = np.argwhere(inside & (normal @ VIEW > 0.2))
    rows = rows[np.random.default_rng(3).choice(len(rows), PIXELS, replace=False)]
    expected = np.array([reflected(brdf, sky, normal[y, x]) for y, x in rows])
    found = np.array([[image[y, x] for y, x in rows] for image in images])
    kept = inside & (normal @ VIEW > 0.2)
    every = (images[0] - images[1])[kept]
    noise = np.sqrt(np.mean(every**2) / 2)  # of one image
    error = found.mean(axis=0) - expected
    assert abs(error.mean()) < 0.003 * expected.mean() + 3 * noise / np.sqrt(6 * PIXELS)
    assert np.sqrt(np.mean(error**2)) < 2.0 * noise / np.sqrt(2) + 0.003 * expected.mean()
