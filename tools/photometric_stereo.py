"""Lights found in the photos of a grey sphere and an owl (../shared/data/real/psm_uw).

The sphere's surface is known. The owl has no scan: its surface is integrated from normals by
photometric stereo with the lights found on the grey sphere, half of the photos at a time, and the
lights of the other half are searched for on it.
"""

from __future__ import annotations

from collections.abc import Iterable
from pathlib import Path

import numpy as np
from numpy.typing import NDArray
from scipy.sparse import coo_matrix, vstack
from scipy.sparse.linalg import lsqr

Array = NDArray[np.float64]

PHOTOS = 12
CLIPPED = 0.99
MIN_LEVEL = 0.05  # of the brightest value: darker pixels are in shadow
MIN_FACING = 0.15  # z of a normal that is integrated
PIXELS = 6000  # of a photo
MAX_RADIUS = 0.9  # of a sphere: its rim is blurred into the background
MIN_LIT_COSINE, LIT_ROUNDS = 0.1, 6  # of incidence; rounds in which the lit pixels are found


def found_lights(folder: Path) -> Iterable[tuple[str, list[float], list[float]]]:
    """Yield (name, errors, standard errors) in degrees, against the chrome sphere's lights."""
    true = np.loadtxt(folder / "lights_chrome_mine.txt").reshape(PHOTOS, 3)
    true /= np.linalg.norm(true, axis=1, keepdims=True)
    mask, photos = read(folder / "data" / "gray", "gray")
    directions, spread = _search(sphere(mask), mask, photos, range(PHOTOS))
    yield "grey sphere", _degrees(directions, true), spread.tolist()
    mask, photos = read(folder / "data" / "owl", "owl")
    errors, spreads = np.zeros(PHOTOS), np.zeros(PHOTOS)
    for half in range(2):
        own = np.arange(half, PHOTOS, 2)
        others = np.arange(1 - half, PHOTOS, 2)
        mesh = integrated(mask, normals(mask, [photos[i] for i in others], directions[others]))
        found, spread = _search(mesh, mask, photos, own)
        errors[own], spreads[own] = _degrees(found, true[own]), spread
    yield "owl", errors.tolist(), spreads.tolist()


def read(folder: Path, name: str) -> tuple[NDArray[np.bool_], list[NDArray[np.float32]]]:
    """(mask, linear photos) of one of the objects."""
    import OpenImageIO as oiio

    def pixels(path: Path) -> NDArray[np.float32]:
        return np.asarray(oiio.ImageBuf(str(path)).get_pixels(oiio.FLOAT))

    mask = pixels(folder / f"{name}.mask.tga")[..., 0] > 0.5
    return mask, [pixels(folder / f"{name}.{i}.tga")[..., :3] for i in range(PHOTOS)]


def _degrees(one: Array, other: Array) -> list[float]:
    return np.degrees(np.arccos(np.clip((one * other).sum(axis=1), -1, 1))).tolist()


def _camera(shape: tuple[int, int]):
    """Orthographic view along −z; x right, y up, one unit a pixel."""
    from patina.core.scan import Camera
    from patina.core.scan.camera import Pose

    height, width = shape
    pose = Pose(np.diag([1.0, -1.0, -1.0]), np.array([0.0, 0.0, 1000.0]))
    return Camera("uw", width, height, "ORTHOGRAPHIC", (1.0, 1.0, width / 2, height / 2), pose)


def _search(mesh, mask, photos, which) -> tuple[Array, Array]:
    """(directions (n, 3), standard errors (n,) in degrees) of some of the photos' lights."""
    from patina.core.basis import default_basis
    from patina.core.concurrency.steps import drained
    from patina.core.geometry import RayScene
    from patina.core.light import DistantLight
    from patina.core.light_search import UnknownLamp, draw_lamp_pixels, find_lamps
    from patina.core.light_search.brdf_dictionary import BrdfDictionary

    rays, rng, camera, lamps = (
        RayScene.build(mesh),
        np.random.default_rng(0),
        _camera(mask.shape),
        [],
    )
    for i in which:
        usable = np.where(mask & (photos[i].max(axis=2) < CLIPPED), 0, -1).astype(np.int16)
        part = draw_lamp_pixels(rays, camera, photos[i], usable, PIXELS, rng)
        lamps.append(UnknownLamp(DistantLight(f"{i}", np.array([0.0, 0.0, 1.0])), (part,)))
    found = drained(find_lamps(lamps, 1, rays, BrdfDictionary.of(default_basis()))).lamps
    spread = np.degrees([one.standard_error for one in found])
    return np.array([one.light.direction for one in found]), spread


def sphere_lights(mask: NDArray[np.bool_], photos: list) -> Array:
    """(photos, 3) directions of distant lights on a matt sphere that fills a mask: for each photo,
    the Lambertian sphere with the least squares of the difference, in the lit pixels."""
    centre, radius = _circle(mask)
    rows, columns = np.nonzero(mask)
    x = (columns + 0.5 - mask.shape[1] / 2 - centre[0]) / radius
    y = (mask.shape[0] / 2 - rows - 0.5 - centre[1]) / radius
    inside = np.hypot(x, y) < MAX_RADIUS
    normal = np.stack([x, y, np.sqrt(np.maximum(1 - x**2 - y**2, 0))], axis=1)[inside]
    found = []
    for photo in photos:
        level = np.asarray(photo, np.float64).mean(axis=2)[mask][inside]
        lit = (level > MIN_LEVEL * level.max()) & (level < CLIPPED)
        light = np.zeros(3)
        for _ in range(LIT_ROUNDS):
            light = np.linalg.lstsq(normal[lit], level[lit], rcond=None)[0]
            facing = normal @ light / np.linalg.norm(light)
            lit = (facing > MIN_LIT_COSINE) & (level < CLIPPED)
        found.append(light / np.linalg.norm(light))
    return np.array(found)


def _circle(mask: NDArray[np.bool_]) -> tuple[Array, float]:
    """(centre (x, y, 0), radius) in pixels of the circle that fills a mask."""
    rows, columns = np.nonzero(mask)
    height, width = mask.shape
    centre = np.array([columns.mean() + 0.5 - width / 2, height / 2 - rows.mean() - 0.5, 0.0])
    return centre, float(np.sqrt(mask.sum() / np.pi))


def sphere(mask: NDArray[np.bool_]):
    """The sphere that fills a mask."""
    from patina.core.scan import Mesh

    centre, radius = _circle(mask)
    polar, around = np.meshgrid(
        np.linspace(0, np.pi, 181), np.linspace(0, 2 * np.pi, 361)[:-1], indexing="ij"
    )
    unit = [np.sin(polar) * np.cos(around), np.sin(polar) * np.sin(around), np.cos(polar)]
    points = np.stack(unit, -1).reshape(-1, 3) * radius + centre
    index = np.arange(181 * 360).reshape(181, 360)
    return Mesh(points, _faces(index, np.roll(index, -1, axis=1)))


def _faces(index: NDArray, right: NDArray) -> NDArray[np.int32]:
    """Two triangles for each cell of a grid of vertices; right: the neighbours of ``index``."""
    first = np.stack([index[:-1], index[1:], right[1:]], -1).reshape(-1, 3)
    second = np.stack([index[:-1], right[1:], right[:-1]], -1).reshape(-1, 3)
    return np.concatenate([first, second]).astype(np.int32)


def normals(mask: NDArray[np.bool_], photos: list, directions: Array) -> Array:
    """(h, w, 3) Lambertian normals of the masked pixels from their lit photos."""
    levels = np.stack([photo.mean(axis=2)[mask] for photo in photos], axis=1).astype(np.float64)
    weight = (levels > MIN_LEVEL * levels.max()) * 1.0
    gram = np.einsum("nk,ki,kj->nij", weight, directions, directions) + 1e-4 * np.eye(3)
    right = np.einsum("nk,nk,ki->ni", weight, levels, directions)
    normal = np.linalg.solve(gram, right[..., None])[..., 0]
    out = np.zeros((*mask.shape, 3))
    out[mask] = normal / np.maximum(np.linalg.norm(normal, axis=1, keepdims=True), 1e-9)
    return out


def integrated(mask: NDArray[np.bool_], normals: Array):
    """The surface with these normals: least squares of the slopes between neighbours."""
    from patina.core.scan import Mesh

    good = mask & (normals[..., 2] > MIN_FACING)
    index = np.full(mask.shape, -1)
    index[good] = np.arange(good.sum())
    z = np.maximum(normals[..., 2], MIN_FACING)
    slope_x, slope_y = -normals[..., 0] / z, -normals[..., 1] / z
    parts, values = [], []
    for there, here, slope in (
        (np.s_[:, 1:], np.s_[:, :-1], slope_x),  # z(x + 1) − z(x)
        (np.s_[:-1], np.s_[1:], slope_y),  # y points up
    ):
        both = good[there] & good[here]
        count = int(both.sum())
        rows = np.concatenate([np.arange(count)] * 2)
        columns = np.concatenate([index[there][both], index[here][both]])
        signs = np.concatenate([np.ones(count), -np.ones(count)])
        parts.append(coo_matrix((signs, (rows, columns)), (count, int(good.sum()))))
        values.append(0.5 * (slope[there][both] + slope[here][both]))
    depth = np.zeros(mask.shape)
    depth[good] = lsqr(vstack(parts).tocsr(), np.concatenate(values), iter_lim=2000)[0]
    height, width = mask.shape
    row, column = np.indices(mask.shape)
    points = np.stack([column + 0.5 - width / 2, height / 2 - row - 0.5, depth], -1).reshape(-1, 3)
    grid = np.arange(height * width).reshape(height, width)
    faces = _faces(grid[:, :-1], grid[:, 1:])
    faces = faces[good.ravel()[faces].all(axis=1)]
    used, faces = np.unique(faces, return_inverse=True)
    return Mesh(points[used], faces.reshape(-1, 3).astype(np.int32))
