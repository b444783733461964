"""Ray-traced photos with known truth, independent of Patina: a block and two balls of veined stone.
Pictures under uniform light for a scan, and photos under one lamp."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

import numpy as np
import OpenImageIO as oiio
import trimesh

WIDTH, HEIGHT, FOCAL = 640, 480, 760.0
PRINCIPAL = (WIDTH / 2, HEIGHT / 2)
DISTANCE = 4.2
BOX = np.array([0.62, 0.5, 0.4])  # half sides, around the origin
BALLS = ((np.array([0.25, 0.1, 0.62]), 0.36), (np.array([-0.3, -0.2, 0.5]), 0.3))


@dataclass(frozen=True)
class View:
    """One view: world → camera, x right, y down, z forward."""

    rotation: np.ndarray
    translation: np.ndarray

    @property
    def centre(self) -> np.ndarray:
        return -self.rotation.T @ self.translation


def look_from(direction, distance=DISTANCE, roll=0.0) -> View:
    """Return a view of the object from a direction (3,), with a roll angle."""
    eye = distance * np.asarray(direction, float) / np.linalg.norm(direction)
    forward = -eye / distance
    right = np.cross(forward, (0.0, 0.0, 1.0))
    right /= np.linalg.norm(right)
    down = np.cross(forward, right)
    c, s = np.cos(roll), np.sin(roll)
    rotation = np.stack([c * right + s * down, -s * right + c * down, forward])
    return View(rotation, -rotation @ eye)


def ring(count, heights=(0.35, 0.8), start=0.0):
    """Return views around the object, at alternating heights."""
    for i in range(count):
        a = start + 2 * np.pi * i / count
        yield look_from((np.cos(a), np.sin(a), heights[i % len(heights)]), roll=0.05 * (i % 3 - 1))


def photo(view: View, light=None, seed=0) -> np.ndarray:
    """Render (h, w, 3) linear radiance, 2 × 2 rays per pixel, with camera noise.

    light None: uniform light, on a uniform grey ground; else one distant lamp in this direction
    (3,), with a highlight, cast shadows and a black background.
    """
    total = np.zeros((HEIGHT, WIDTH, 3))
    for dx in (0.25, 0.75):
        for dy in (0.25, 0.75):
            rows, columns = np.indices((HEIGHT, WIDTH), float)
            rays = np.stack(
                [
                    (columns + dx - PRINCIPAL[0]) / FOCAL,
                    (rows + dy - PRINCIPAL[1]) / FOCAL,
                    np.ones((HEIGHT, WIDTH)),
                ],
                axis=-1,
            ).reshape(-1, 3)
            rays = rays / np.linalg.norm(rays, axis=1, keepdims=True) @ view.rotation
            total += _shaded(view.centre, rays, light).reshape(HEIGHT, WIDTH, 3)
    mean = total / 4
    noise = np.random.default_rng(seed).normal(size=mean.shape)
    return np.maximum(mean + noise * np.sqrt(1e-6 + 1e-4 * mean), 0.0)


def _shaded(start, rays, light):
    distance, normal = first_hit(np.broadcast_to(start, rays.shape), rays)
    hit = np.isfinite(distance)
    result = np.zeros((len(rays), 3)) if light is not None else np.full((len(rays), 3), 0.05)
    points, n, v = start + distance[hit, None] * rays[hit], normal[hit], -rays[hit]
    albedo = stone(points)
    if light is None:
        result[hit] = albedo * (0.75 + 0.25 * n[:, 2:])
        return result
    light = np.asarray(light, float) / np.linalg.norm(light)
    half = (light + v) / np.linalg.norm(light + v, axis=1, keepdims=True)
    sheen = 0.25 * np.maximum(np.einsum("ij,ij->i", n, half), 0.0)[:, None] ** 40
    towards = np.broadcast_to(light, n.shape)
    shadow = np.isfinite(first_hit(points + 1e-6 * n, towards)[0])
    result[hit] = (albedo + sheen) * np.maximum(n @ light, 0.0)[:, None] * ~shadow[:, None]
    return result


def first_hit(start, rays):
    """Return (distance (n,), inf without a hit; unit normal (n, 3)) of rays (n, 3)."""
    with np.errstate(divide="ignore", invalid="ignore"):
        low, high = (-BOX - start) / rays, (BOX - start) / rays
    near, far = np.minimum(low, high), np.maximum(low, high)
    axis = near.argmax(axis=1)
    entry = near.max(axis=1)
    distance = np.where((entry < far.min(axis=1)) & (entry > 0), entry, np.inf)
    normal = np.zeros_like(rays)
    rows = np.arange(len(rays))
    normal[rows, axis] = -np.sign(rays[rows, axis])
    for centre, radius in BALLS:
        offset = start - centre
        b = np.einsum("ij,ij->i", rays, offset)
        under = b**2 - (np.einsum("ij,ij->i", offset, offset) - radius**2)
        t = -b - np.sqrt(np.maximum(under, 0.0))
        closer = (under > 0) & (t > 0) & (t < distance)
        distance[closer] = t[closer]
        normal[closer] = (offset[closer] + t[closer, None] * rays[closer]) / radius
    return distance, normal


def stone(points) -> np.ndarray:
    """Return albedo (n, 3): value noise of five octaves, from random values on a lattice."""
    value = sum(_noise(points * 6.0 * 2**k, k) / 1.5**k for k in range(5))
    grey = np.clip(0.5 + 0.45 * value, 0.03, 1.0)[:, None]
    return grey * np.array([0.9, 0.75, 0.6])


def _noise(p, octave):
    lattice = np.random.default_rng(100 + octave).uniform(-1, 1, 4096)
    cell = np.floor(p).astype(np.int64)
    t = p - cell
    t = t * t * (3 - 2 * t)
    result = np.zeros(len(p))
    for corner in np.ndindex(2, 2, 2):
        at = cell + corner
        place = (at[:, 0] * 73856093 ^ at[:, 1] * 19349663 ^ at[:, 2] * 83492791) % 4096
        weight = np.prod(np.where(corner, t, 1 - t), axis=1)
        result += weight * lattice[place]
    return result


def write_picture(path: Path, radiance, exposure=0.9, **exif) -> None:
    """Write an 8-bit sRGB picture, like a camera."""
    linear = np.clip(radiance * exposure, 0.0, 1.0)
    encoded = np.where(linear < 0.0031308, 12.92 * linear, 1.055 * linear ** (1 / 2.4) - 0.055)
    write_pixels(path, np.round(255 * encoded).astype(np.uint8), "uint8", **exif)


def write_pixels(path: Path, pixels, kind: str, **attributes) -> None:
    height, width, channels = pixels.shape
    spec = oiio.ImageSpec(width, height, channels, kind)
    if path.suffix == ".jpg":
        spec.attribute("Compression", "jpeg:95")
    for name, value in attributes.items():
        spec.attribute(name.replace("_", ":", 1), value)
    output = oiio.ImageOutput.create(str(path))
    output.open(str(path), spec)
    output.write_image(np.ascontiguousarray(pixels))
    output.close()


def write_mesh(path: Path) -> None:
    """Write the surface of the object; the balls are accurate to 0.0003."""
    parts = [trimesh.creation.box(2 * BOX)]
    for centre, radius in BALLS:
        ball = trimesh.creation.icosphere(5, radius)
        ball.apply_translation(centre)
        parts.append(ball)
    trimesh.util.concatenate(parts).export(path)
