"""Create a capture of any size for speed tests: a bumpy ball, with analytically computed photos."""

from __future__ import annotations

from pathlib import Path

import numpy as np

BUMP, WAVES = 0.01, np.array([9.0, 7.0, 8.0])
DISTANCE, FILLS = (
    4.0,
    0.46,
)  # in radii of the ball; radius of its image, fraction of the photo's height
ALBEDO = np.array([0.16, 0.06, 0.04])
IRRADIANCE = 3.0
ASPECT = (3, 2)
PAINT, PAINT_WAVES = 0.5, 25.0  # share of the colour that changes, waves a radius along each axis
WHITE, JPEG_QUALITY = 1.5, 92  # radiance that a JPEG shows as white
DISTORTION = (-0.08, 0.03)  # k1, k2 of a typical zoom lens


def photo_size(megapixels: float) -> tuple[int, int]:
    """Return (width, height) of a 3:2 photo."""
    unit = round((megapixels * 1e6 / (ASPECT[0] * ASPECT[1])) ** 0.5)
    return ASPECT[0] * unit, ASPECT[1] * unit


def make_capture(
    folder: Path, megapixels: float, triangles: int, photos: int = 8, painted: bool = False
) -> Path:
    """Write mesh (binary PLY), cameras (COLMAP text) and photos (half-float EXR; JPEG of a surface
    in changing colours if ``painted``).

    Returns the path of the capture file.
    """
    folder.mkdir(parents=True, exist_ok=True)
    write_mesh(folder / "mesh.ply", triangles)
    width, height = photo_size(megapixels)
    # the outline of a sphere of radius 1 at DISTANCE is at the tangent of this angle
    focal = FILLS * height / np.tan(np.arcsin(1.0 / DISTANCE))
    lens = f"{focal:.9g} {width / 2} {height / 2} {DISTORTION[0]} {DISTORTION[1]}"
    cameras = folder / "cameras"
    cameras.mkdir(exist_ok=True)
    (cameras / "cameras.txt").write_text(f"1 RADIAL {width} {height} {lens}\n")
    (cameras / "points3D.txt").write_text("")
    images, lights, shots = [], [], []
    ending = "jpg" if painted else "exr"
    for i in range(photos):
        rotation, translation, light = _view(i, photos)
        w, x, y, z = _quaternion(rotation)
        t = " ".join(f"{v:.12g}" for v in translation)
        images.append(f"{i + 1} {w:.12g} {x:.12g} {y:.12g} {z:.12g} {t} 1 view_{i}.jpg\n\n")
        towards = ", ".join(f"{v:.12g}" for v in light)
        lights.append(f'[[light]]\nname = "lamp{i}"\ndirection = [{towards}]\n')
        lights.append(f"irradiance = [{IRRADIANCE}, {IRRADIANCE}, {IRRADIANCE}]\n\n")
        shots.append(f'[[photo]]\nfile = "lit_{i}.{ending}"\ncamera = "view_{i}.jpg"\n')
        shots.append(f'light = "lamp{i}"\n\n')
        pixels = _photo(width, height, focal, rotation, translation, light, i, painted)
        _write(folder / f"lit_{i}.{ending}", pixels)
    (cameras / "images.txt").write_text("".join(images))
    path = folder / "ball.capture.toml"
    scan = '[scan]\ncameras = "cameras"\nmesh = "mesh.ply"\n\n'
    path.write_text("".join([scan, *lights, *shots]))
    return path


def _write(path: Path, pixels: np.ndarray) -> None:
    """Write linear radiance (h, w, 3) as half-float EXR, or as JPEG that shows up to WHITE."""
    import OpenImageIO as oiio

    from patina.core.photo.image import write_exr
    from patina.core.photo.transfer import srgb_encoded

    if path.suffix == ".exr":
        write_exr(path, pixels, half=True)
        return
    shown = np.empty(pixels.shape, np.uint8)
    for row in range(len(pixels)):  # a whole photo in double precision takes 600 MB
        shown[row] = np.round(255 * srgb_encoded(np.clip(pixels[row] / WHITE, 0, 1)))
    spec = oiio.ImageSpec(pixels.shape[1], pixels.shape[0], 3, "uint8")
    spec.attribute("Compression", f"jpeg:{JPEG_QUALITY}")
    file = oiio.ImageOutput.create(str(path))
    file.open(str(path), spec)
    file.write_image(shown)
    file.close()


def write_mesh(path: Path, triangles: int) -> None:
    """Write the ball with about this number of triangles, as binary PLY."""
    rows = round((triangles / 4) ** 0.5)
    columns = 2 * rows
    polar = np.pi * (np.arange(rows) + 0.5) / rows
    azimuth = 2 * np.pi * np.arange(columns) / columns
    sine = np.sin(polar)[:, None]
    grid = np.stack(
        [sine * np.cos(azimuth), sine * np.sin(azimuth), np.cos(polar)[:, None] + 0 * azimuth], -1
    )
    points = np.concatenate([grid.reshape(-1, 3), [[0, 0, 1], [0, 0, -1]]])
    points *= 1 + BUMP * np.sin(points * WAVES).prod(axis=1, keepdims=True)
    i, j = np.indices((rows - 1, columns))
    a, b = i * columns + j, i * columns + (j + 1) % columns
    c, d = a + columns, b + columns
    ring = np.arange(columns)
    onward = (ring + 1) % columns
    top, bottom = rows * columns, rows * columns + 1
    last = (rows - 1) * columns
    faces = np.concatenate(
        [
            np.stack([a, c, d], -1).reshape(-1, 3),
            np.stack([a, d, b], -1).reshape(-1, 3),
            np.stack([np.full(columns, top), ring, onward], -1),
            np.stack([np.full(columns, bottom), last + onward, last + ring], -1),
        ]
    )
    table = np.empty(len(faces), [("n", "u1"), ("v", "<i4", 3)])
    table["n"], table["v"] = 3, faces
    head = f"ply\nformat binary_little_endian 1.0\nelement vertex {len(points)}\n"
    head += "".join(f"property float {axis}\n" for axis in "xyz")
    head += f"element face {len(faces)}\nproperty list uchar int vertex_indices\nend_header\n"
    path.write_bytes(head.encode() + points.astype("<f4").tobytes() + table.tobytes())


def _view(i: int, count: int) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Return (rotation world → camera, translation, direction to the light) of photo i."""
    turn = 2 * np.pi * i / count
    eye = np.array([np.cos(turn), np.sin(turn), 0.5 * np.cos(2 * turn)])
    eye *= DISTANCE / np.linalg.norm(eye)
    forward = -eye / DISTANCE
    right = np.cross(forward, [0.0, 0.0, 1.0])
    right /= np.linalg.norm(right)
    rotation = np.stack([right, np.cross(forward, right), forward])
    away, side = np.radians((25, 50, 80)[i % 3]), 2.4 * i
    light = np.array([np.sin(away) * np.cos(side), np.sin(away) * np.sin(side), -np.cos(away)])
    return rotation, -rotation @ eye, rotation.T @ light


def _photo(
    width: int,
    height: int,
    focal: float,
    rotation: np.ndarray,
    translation: np.ndarray,
    light: np.ndarray,
    seed: int,
    painted: bool,
) -> np.ndarray:
    """Render (h, w, 3) float32: matte body, Blinn lobe, 1 % noise. Bumps change only the
    normals, and the lens has only the first distortion term."""
    eye, light = (-rotation.T @ translation).astype(np.float32), light.astype(np.float32)
    rng = np.random.default_rng(seed)
    out = np.zeros((height, width, 3), np.float32)
    x = ((np.arange(width, dtype=np.float32) + 0.5) - width / 2) / np.float32(focal)
    for top in range(0, height, 128):
        rows = np.arange(top, min(top + 128, height), dtype=np.float32)
        y = ((rows + 0.5) - height / 2) / np.float32(focal)
        u, v = np.meshgrid(x.astype(np.float32), y.astype(np.float32))
        undo = 1 - np.float32(DISTORTION[0]) * (u * u + v * v)
        rays = np.stack([u * undo, v * undo, np.ones_like(u)], -1)
        rays /= np.sqrt((rays * rays).sum(-1, keepdims=True))
        rays = rays @ rotation.astype(np.float32)
        b = rays @ eye
        under = b * b - (eye @ eye - 1)
        hit = under > 0
        ray = rays[hit]
        point = eye + (-b[hit] - np.sqrt(under[hit]))[:, None] * ray
        waves = WAVES.astype(np.float32)
        s, c = np.sin(point * waves), np.cos(point * waves)
        slope = (
            BUMP
            * waves
            * c
            * np.stack([s[:, 1] * s[:, 2], s[:, 0] * s[:, 2], s[:, 0] * s[:, 1]], -1)
        )
        slope -= (slope * point).sum(-1, keepdims=True) * point
        normal = point - slope.astype(np.float32)
        normal /= np.sqrt((normal * normal).sum(-1, keepdims=True))
        half = light - ray
        half /= np.sqrt((half * half).sum(-1, keepdims=True))
        lobe = 0.8 * np.maximum((normal * half).sum(-1), 0) ** 60
        cosine = np.maximum(normal @ light, 0)
        noise = 1 + 0.01 * rng.standard_normal(cosine.shape, np.float32)
        albedo = ALBEDO.astype(np.float32)
        if painted:
            albedo = albedo * (1 + np.float32(PAINT) * np.sin(np.float32(PAINT_WAVES) * point))
        shade = (IRRADIANCE * cosine * noise)[:, None] * (albedo + lobe[:, None])
        out[top : top + len(rows)][hit] = shade
    return out


def _quaternion(rotation: np.ndarray) -> np.ndarray:
    """Return the quaternion (w, x, y, z) of a rotation."""
    from scipy.spatial.transform import Rotation

    return np.roll(Rotation.from_matrix(rotation).as_quat(), 1)
