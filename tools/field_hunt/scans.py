"""Exact surfaces, and the meshes and cameras that a reconstruction finds of them."""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import lru_cache

import numpy as np
import trimesh
from numpy.typing import NDArray

from patina.core.capture import read_capture
from patina.core.inputs import capture_data
from patina.core.scan import Mesh

from ..demo_render import Camera
from ..demo_shape import Surface, vertex_normals
from ..experiments import mesh_error, shapes
from ..experiments.materials import data_folder
from ..hunt.shape import lumpy

Array = NDArray[np.float64]

BUNNIES = ("bunny_red", "bunny_bronze", "bunny_fabric")
"""Captures whose meshes and poses are those of dense stereo and structure from motion."""
OWN = ("jar", "pebble", "knot", "lumpy")
MEDIAN_ERROR = 0.85  # degrees, of normals of stereo meshes (reference.md, section 7)
SPREAD_OF_ERROR = (
    0.9  # of the logarithm of the amplitude, so that the 95th percentile is 4 times it
)
SIZE = (512, 400)  # pixels
VIEW_ANGLE = 0.85  # of the object, as a fraction of the photo's height
POSE_ERROR = 0.3  # pixels, RMS


@dataclass(frozen=True)
class FieldScan:
    """exact: the surface, its centre at the origin and its bounding sphere of radius 0.5; mesh: as
    reconstructed. cameras: of the photos; stated: as reconstructed."""

    exact: Surface
    mesh: Mesh
    cameras: tuple[Camera, ...]
    stated: tuple[Camera, ...]


def field_scan(name: str, photos: int, rng: np.random.Generator) -> FieldScan:
    """A scan of one of BUNNIES or OWN, with cameras drawn at random around it (OWN) or among those
    of structure from motion (BUNNIES)."""
    if name in BUNNIES:
        return _bunny(name, photos, rng)
    exact = _own(name, int(rng.integers(1 << 30)) if name == "lumpy" else 0)
    mesh = stereo_like(exact, rng)
    cameras = tuple(_camera(rng, k, photos) for k in range(photos))
    return FieldScan(exact, mesh, cameras, tuple(_with_pose_error(c, rng) for c in cameras))


@lru_cache(maxsize=4)
def _own(name: str, seed: int) -> Surface:
    if name == "lumpy":
        surface = lumpy(seed)
        points, triangles = surface.points, surface.triangles
    else:
        mesh = shapes.true_shape(name)
        points, triangles = mesh.vertices, mesh.faces.astype(np.int64)
    points = _normalised(points)[0]
    return Surface(points, triangles, vertex_normals(points, triangles))


def _normalised(points: Array) -> tuple[Array, Array, float]:
    """(points with their centre at 0 in a sphere of radius 0.5, that centre, scale)."""
    centre = 0.5 * (points.min(axis=0) + points.max(axis=0))
    scale = 0.5 / float(np.linalg.norm(points - centre, axis=1).max())
    return scale * (points - centre), centre, scale


def stereo_like(exact: Surface, rng: np.random.Generator) -> Mesh:
    """A mesh with errors of dense stereo: normals are off by 0.8° in the median and by 3 to 4° at
    the 95th percentile; errors are correlated over patches of several sizes, larger in some areas;
    edges are rounded."""
    true = Mesh(exact.points, exact.triangles.astype(np.int32))
    seed = int(rng.integers(1 << 30))
    smooth = mesh_error.blurred(true, 0.25 * MEDIAN_ERROR, seed)
    points = exact.points
    area = np.exp(SPREAD_OF_ERROR * shapes.waves(0.35, seed + 1)(points))
    field = np.zeros(len(points))
    for wavelength, weight in ((0.02, 0.5), (0.05, 0.35), (0.15, 0.15)):
        # the slope of a wave is its amplitude over its length
        field += weight * wavelength * shapes.waves(wavelength, int(rng.integers(1 << 30)))(points)
    amplitude = 0.01
    for _ in range(6):
        moved = smooth.vertices + (amplitude * area * field)[:, None] * exact.normals
        error = float(np.median(mesh_error.normal_errors(moved, true)))
        amplitude *= MEDIAN_ERROR / error
    return replace(true, vertices=moved)


def _camera(rng: np.random.Generator, k: int, photos: int) -> Camera:
    """A camera that looks at the origin, one of ``photos`` around it."""
    around = 2 * np.pi * k / photos + rng.uniform(-0.15, 0.15)
    up = rng.uniform(-0.15, 0.7)
    eye = rng.uniform(2.6, 3.4) * np.array(
        [np.cos(around) * np.cos(up), np.sin(around) * np.cos(up), np.sin(up)]
    )
    forward = -eye / np.linalg.norm(eye)
    right = np.cross(forward, [0, 0, 1.0])
    right /= np.linalg.norm(right)
    rotation = np.stack([right, np.cross(forward, right), forward])
    focal = VIEW_ANGLE * SIZE[1] * (float(np.linalg.norm(eye)) - 0.3)
    centre = (SIZE[0] / 2 + rng.uniform(-20, 20), SIZE[1] / 2 + rng.uniform(-20, 20))
    return Camera(rotation, -rotation @ eye, focal, centre, SIZE)


def _with_pose_error(camera: Camera, rng: np.random.Generator) -> Camera:
    """The camera, rotated such that the photo is shifted by POSE_ERROR, and turned by as much."""
    a, b = rng.normal(0, POSE_ERROR / np.sqrt(2) / camera.focal, 2)
    c = rng.normal(0, POSE_ERROR / (0.3 * camera.size[1]))
    tilt = np.array([[1, -c, -a], [c, 1, -b], [a, b, 1.0]])
    left, _, right = np.linalg.svd(tilt)
    rotation = left @ right @ camera.rotation
    return replace(camera, rotation=rotation, translation=-rotation @ camera.position)


def _bunny(name: str, photos: int, rng: np.random.Generator) -> FieldScan:
    folder = data_folder() / "scans"
    scan = capture_data.open_scan(read_capture(folder / name / "scan.capture.toml"))
    truth = trimesh.load(folder / "bunny_truth.ply", process=False)
    points, centre, scale = _normalised(np.asarray(truth.vertices, np.float64))
    triangles = np.asarray(truth.faces, np.int64)
    exact = Surface(points, triangles, vertex_normals(points, triangles))
    mesh = replace(scan.mesh, vertices=scale * (scan.mesh.vertices - centre))
    posed = [one for one in scan.cameras if one.pose is not None]
    first = int(rng.integers(len(posed)))
    chosen = [posed[(first + k * len(posed) // photos) % len(posed)] for k in range(photos)]
    stated = tuple(_moved(one, centre, scale) for one in chosen)
    # the reconstruction's own pose errors are unknown: as large ones are put into the photos
    return FieldScan(exact, mesh, tuple(_with_pose_error(c, rng) for c in stated), stated)


def _moved(camera, centre: Array, scale: float) -> Camera:  # type: ignore[no-untyped-def]
    """A camera of the scan, in the normalised frame and without distortion, SIZE[0] wide."""
    factor = SIZE[0] / camera.width
    focal, cx, cy = _pinhole(camera)
    rotation = camera.pose.rotation
    translation = scale * (camera.pose.translation + rotation @ centre)
    size = (SIZE[0], round(factor * camera.height))
    return Camera(rotation, translation, factor * focal, (factor * cx, factor * cy), size)


def _pinhole(camera) -> tuple[float, float, float]:  # type: ignore[no-untyped-def]
    values = camera.parameters
    if camera.model in ("SIMPLE_PINHOLE", "SIMPLE_RADIAL", "RADIAL"):
        return values[0], values[1], values[2]
    return 0.5 * (values[0] + values[1]), values[2], values[3]
