"""Write capture files for the real photographs in ../shared/data/real to a given folder.

The captures refer to the photographs, which are not copied.
"""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np

CHART_CORNERS = [
    [928, 880],
    [922, 480],
    [1160, 472],
    [1168, 880],
]  # measured by hand in the photo, pixels


def rodin(data: Path, folder: Path, chart: bool, refine: bool) -> Path:
    """Write the Rodin bronze: 16 flash photos. chart: tone curve from the colour chart; refine:
    refine the position of the flash. Returns the capture file."""
    source = (data / "real" / "rodin_bronze").resolve()
    photo = source / "colorchecker" / "231016_miaEURO_9505.jpg"
    lines = ["[scan]", f'cameras = "{source / "cameras.xml"}"', f'mesh = "{source / "mesh.ply"}"']
    if chart:
        lines += ["[tone]", f'chart = {{photo = "{photo}", corners = {CHART_CORNERS}}}']
    lines += ["[[light]]", 'name = "flash"', "mounted = [0, 0, 0]"]
    lines += [f"refine = {str(refine).lower()}"]
    for lit in sorted((source / "photos").glob("*.jpg")):
        lines += ["[[photo]]", f'file = "{lit}"', f'camera = "{lit.stem}"', 'light = "flash"']
    path = folder / f"rodin_{'chart' if chart else 'srgb'}_{'flash' if refine else 'camera'}"
    return _write(path.with_suffix(".capture.toml"), lines)


def ball(data: Path, folder: Path) -> Path:
    """Write the DiLiGenT ball: a sphere in orthographic view along z, with 24 distant lights.

    One unit is one pixel; x right, y up, z to the camera, as in its files. Intensities are relative
    to each other, so that the BRDF is known up to a scale. Returns the capture file.
    """
    source = (data / "real" / "diligent_ball").resolve()
    from patina.core.photo import read_mask  # the package is loaded by the caller

    mask = read_mask(source / "mask.png")
    height, width = mask.shape
    rows, columns = np.nonzero(mask)
    cx, cy = columns.mean() + 0.5, rows.mean() + 0.5
    radius = float(np.sqrt(mask.sum() / np.pi))
    camera = {
        "label": "ball", "width": width, "height": height, "model": "ORTHOGRAPHIC",
        "parameters": [1.0, 1.0, cx, cy], "rotation": np.diag([1.0, -1.0, -1.0]).tolist(),
        "translation": [0.0, 0.0, 10 * radius], "photo": None,
    }  # fmt: skip
    cameras = {"patina_cameras": 1, "frame": "mesh", "cameras": [camera]}
    (folder / "ball.cameras.json").write_text(json.dumps(cameras))
    _write_sphere(folder / "ball.ply", radius)
    lines = ["[scan]", 'cameras = "ball.cameras.json"', 'mesh = "ball.ply"']
    lines += ["[tone]", 'transfer = "linear"', "[fit]", "absolute = false"]
    directions = np.loadtxt(source / "light_directions.txt")
    intensities = np.loadtxt(source / "light_intensities.txt")
    names = (source / "filenames.txt").read_text().split()
    photos = []
    for name, direction, intensity in zip(names, directions, intensities, strict=True):
        lines += ["[[light]]", f'name = "{name}"', f"direction = {direction.tolist()}"]
        lines += [f"irradiance = {intensity.tolist()}"]
        photos += ["[[photo]]", f'file = "{source / name}"', 'camera = "ball"', f'light = "{name}"']
    return _write(folder / "ball.capture.toml", lines + photos)


def _write(path: Path, lines: list[str]) -> Path:
    path.write_text("\n".join(lines) + "\n")
    return path


def _write_sphere(path: Path, radius: float) -> None:
    """Write a fine sphere around the origin: the convex hull of a Fibonacci lattice, ASCII PLY."""
    from scipy.spatial import ConvexHull

    count = 40_000
    i = np.arange(count)
    z = 1 - (2 * i + 1) / count
    turn = i * np.pi * (3 - np.sqrt(5))
    flat = np.sqrt(1 - z**2)
    points = np.stack([flat * np.cos(turn), flat * np.sin(turn), z], axis=1)
    faces = ConvexHull(points).simplices
    a, b, c = points[faces].transpose(1, 0, 2)
    inward = np.einsum("ij,ij->i", np.cross(b - a, c - a), a) < 0
    faces[inward] = faces[inward][:, ::-1]
    lines = ["ply", "format ascii 1.0", f"element vertex {count}"]
    lines += [f"property double {axis}" for axis in "xyz"]
    lines += [f"element face {len(faces)}", "property list uchar int vertex_indices", "end_header"]
    lines += [f"{x:.9g} {y:.9g} {z:.9g}" for x, y, z in radius * points]
    lines += [f"3 {a} {b} {c}" for a, b, c in faces]
    path.write_text("\n".join(lines) + "\n")
