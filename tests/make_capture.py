"""A small capture with known truth, independent of Patina: a ray-traced glossy sphere, with cameras
written by pycolmap and photos by OpenImageIO."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import OpenImageIO as oiio
import pycolmap

WIDTH, HEIGHT, FOCAL = 120, 90, 200.0
PRINCIPAL = (57.0, 47.5)  # off centre
DISTANCE = 3.6
CENTRE = np.array([0.3, -0.2, 0.5])
IRRADIANCE = 3.0


def blinn(normal, light, view):
    """Return a reciprocal reflectance (n, 3) in 1/sr: matte body and Blinn lobe."""
    half = light + view
    half = half / np.linalg.norm(half, axis=-1, keepdims=True)
    lobe = np.maximum(np.sum(normal * half, axis=-1), 0.0) ** 60
    return np.array([0.16, 0.05, 0.04]) + 0.8 * lobe[:, None]


def look_at(eye, target):
    """Return (rotation world → camera, translation): x right, y down, z forward."""
    forward = (target - eye) / np.linalg.norm(target - eye)
    right = np.cross(forward, np.array([0.1, 0.2, 1.0]))
    right /= np.linalg.norm(right)
    rotation = np.stack([right, np.cross(forward, right), forward])
    return rotation, -rotation @ eye


def poses(count=6):
    angles = 2 * np.pi * np.arange(count) / count
    for a in angles:
        direction = np.array([np.cos(a), np.sin(a), 0.35 * np.cos(2 * a)])
        eye = CENTRE + DISTANCE * direction / np.linalg.norm(direction)
        yield look_at(eye, CENTRE)


def light_directions(count=6):
    """Return lights at 25°, 60° … from each view, at different azimuths."""
    for i, (rotation, _) in enumerate(poses(count)):
        away = np.radians((25, 60, 95)[i % 3])
        turn = 2.4 * i
        towards = np.array(
            [np.sin(away) * np.cos(turn), np.sin(away) * np.sin(turn), -np.cos(away)]
        )
        yield rotation.T @ towards


def photo(rotation, translation, light, radius=1.0, brdf=blinn, lamp=None):
    """Render (h, w, 3) radiance of the sphere; 0 elsewhere. lamp: (position, intensity) of a near
    lamp that replaces the distant ``light``."""
    rows, columns = np.indices((HEIGHT, WIDTH)) + 0.5
    rays = np.stack(
        [(columns - PRINCIPAL[0]) / FOCAL, (rows - PRINCIPAL[1]) / FOCAL, np.ones((HEIGHT, WIDTH))],
        axis=-1,
    ).reshape(-1, 3)
    rays = rays / np.linalg.norm(rays, axis=1, keepdims=True) @ rotation
    eye = -rotation.T @ translation - CENTRE
    b = rays @ eye
    under = b**2 - (eye @ eye - radius**2)
    hit = under > 0
    distance = -b[hit] - np.sqrt(under[hit])
    normal = (eye + distance[:, None] * rays[hit]) / radius
    irradiance = IRRADIANCE
    if lamp is None:
        towards = np.broadcast_to(light, normal.shape)
    else:
        towards = lamp[0] - (CENTRE + radius * normal)
        away = np.sqrt(np.sum(towards**2, axis=1))
        towards, irradiance = towards / away[:, None], lamp[1] / away**2
    cos_i = np.maximum(np.sum(normal * towards, axis=1), 0.0)
    image = np.zeros((HEIGHT * WIDTH, 3))
    image[hit] = brdf(normal, towards, -rays[hit]) * (irradiance * cos_i)[:, None]
    return image.reshape(HEIGHT, WIDTH, 3)


def write_ball_photo(path: Path, place: int, radius: float) -> None:
    """Write the photo of the view ``place`` of a dark glossy ball before a grey wall."""
    rotation, translation = list(poses())[place]
    light = list(light_directions())[place]

    def dark(normal, light, view):
        half = light + view
        half = half / np.linalg.norm(half, axis=-1, keepdims=True)
        lobe = np.maximum(np.sum(normal * half, axis=-1), 0.0) ** 2000
        return np.full(3, 0.003) + 20 * lobe[:, None]

    eye = -rotation.T @ translation
    inside = photo(rotation, translation, light, radius, lamp=(eye, 1.0)).max(axis=2) > 0
    image = photo(rotation, translation, light, radius, brdf=dark)
    image[~inside] = 0.2
    write_exr(path, image)


def sphere_mesh(subdivisions=5):
    """Return (vertices, faces) of a subdivided icosahedron around CENTRE, radius 1."""
    g = (1 + 5**0.5) / 2
    v = [(-1, g, 0), (1, g, 0), (-1, -g, 0), (1, -g, 0), (0, -1, g), (0, 1, g), (0, -1, -g),
         (0, 1, -g), (g, 0, -1), (g, 0, 1), (-g, 0, -1), (-g, 0, 1)]  # fmt: skip
    f = [(0, 11, 5), (0, 5, 1), (0, 1, 7), (0, 7, 10), (0, 10, 11), (1, 5, 9), (5, 11, 4),
         (11, 10, 2), (10, 7, 6), (7, 1, 8), (3, 9, 4), (3, 4, 2), (3, 2, 6), (3, 6, 8),
         (3, 8, 9), (4, 9, 5), (2, 4, 11), (6, 2, 10), (8, 6, 7), (9, 8, 1)]  # fmt: skip
    vertices, faces = np.array(v, float), np.array(f)
    for _ in range(subdivisions):
        edges = np.sort(faces[:, [[0, 1], [1, 2], [2, 0]]].reshape(-1, 2), axis=1)
        unique, inverse = np.unique(edges, axis=0, return_inverse=True)
        middle = inverse.reshape(-1, 3) + len(vertices)
        vertices = np.concatenate([vertices, vertices[unique].mean(axis=1)])
        a, b, c = faces.T
        ab, bc, ca = middle.T
        faces = np.concatenate(
            [np.stack(t, 1) for t in ((a, ab, ca), (b, bc, ab), (c, ca, bc), (ab, bc, ca))]
        )
    return vertices / np.linalg.norm(vertices, axis=1, keepdims=True) + CENTRE, faces


def write_ply(path: Path, vertices, faces, face_attribute=None) -> None:
    """Write an ASCII PLY."""
    lines = ["ply", "format ascii 1.0", f"element vertex {len(vertices)}"]
    lines += [f"property double {axis}" for axis in "xyz"]
    lines += [f"element face {len(faces)}", "property list uchar int vertex_indices"]
    if face_attribute is not None:
        lines.append("property int part")
    lines.append("end_header")
    lines += [" ".join(f"{x:.9g}" for x in row) for row in vertices]
    for i, row in enumerate(faces):
        tail = "" if face_attribute is None else f" {face_attribute[i]}"
        lines.append("3 " + " ".join(str(x) for x in row) + tail)
    path.write_text("\n".join(lines) + "\n")


def write_exr(path: Path, pixels) -> None:
    """Write a float EXR."""
    data = np.ascontiguousarray(pixels, np.float32)
    spec = oiio.ImageSpec(data.shape[1], data.shape[0], data.shape[2], "float")
    out = oiio.ImageOutput.create(str(path))
    out.open(str(path), spec)
    out.write_image(data)
    out.close()


def write_png(path: Path, mask) -> None:
    """Write an 8-bit grey image."""
    data = np.ascontiguousarray(mask, np.uint8)[..., None]
    out = oiio.ImageOutput.create(str(path))
    out.open(str(path), oiio.ImageSpec(data.shape[1], data.shape[0], 1, "uint8"))
    out.write_image(data)
    out.close()


def write_colmap(folder: Path, count=6, text=False, model="PINHOLE", params=None) -> None:
    """Write a COLMAP model with one lens and the poses."""
    params = params or [FOCAL, FOCAL, *PRINCIPAL]
    made = pycolmap.Reconstruction()
    lens = pycolmap.Camera(model=model, width=WIDTH, height=HEIGHT, params=params, camera_id=1)
    made.add_camera_with_trivial_rig(lens)
    for i, (rotation, translation) in enumerate(poses(count), start=1):
        image = pycolmap.Image(name=f"view_{i:02d}.jpg", camera_id=1, image_id=i)
        pose = pycolmap.Rigid3d(pycolmap.Rotation3d(rotation), translation)
        made.add_image_with_trivial_frame(image, pose)
    folder.mkdir(parents=True, exist_ok=True)
    if text:
        made.write_text(str(folder))
    else:
        made.write_binary(str(folder))


def make_capture(folder: Path, photos=6, extra="", brdf=blinn) -> Path:
    """Write all files; return the capture file."""
    folder.mkdir(parents=True, exist_ok=True)
    write_colmap(folder / "sparse", photos)
    write_ply(folder / "mesh.ply", *sphere_mesh())
    lines = ["[scan]", 'cameras = "sparse"', 'mesh = "mesh.ply"', ""]
    found = enumerate(zip(poses(photos), light_directions(photos), strict=True), start=1)
    tail = []
    for i, ((rotation, translation), light) in found:
        write_exr(folder / f"lit_{i}.exr", photo(rotation, translation, light, brdf=brdf))
        direction = ", ".join(f"{x:.12g}" for x in light)
        lines += ["[[light]]", f'name = "lamp{i}"', f"direction = [{direction}]",
                  f"irradiance = [{IRRADIANCE}, {IRRADIANCE}, {IRRADIANCE}]", ""]  # fmt: skip
        tail += ["[[photo]]", f'file = "lit_{i}.exr"', f'camera = "view_{i:02d}.jpg"',
                 f'light = "lamp{i}"', ""]  # fmt: skip
    path = folder / "ball.capture.toml"
    path.write_text("\n".join([*lines, *tail, extra]) + "\n")
    return path
