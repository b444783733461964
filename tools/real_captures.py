"""Write capture files for the real photographs in ../shared/data/real to a given folder.

The captures refer to the photographs, which are not copied.
"""

from __future__ import annotations

import json
from collections.abc import Callable
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

if TYPE_CHECKING:
    from patina.core.scan import Mesh

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


def diligent(
    data: Path, folder: Path, name: str, change: Callable[[Mesh], Mesh] | None = None
) -> Path:
    """Write DiLiGenT's "reading" or "cat": one orthographic view under distant lights, on the mesh
    that was integrated from the true normals. change: returns the mesh with errors (None: as it
    is). Returns the capture file; see ``ball`` for frame and units.
    """
    source = (data / "real" / f"diligent_{name}").resolve()
    from patina.core.photo import read_mask
    from patina.core.scan.mesh import read_mesh

    mesh = source / "mesh_from_gt_normals.ply"
    if change is not None:
        mesh = folder / f"{name}_changed.ply"
        _write_mesh(mesh, change(read_mesh(source / "mesh_from_gt_normals.ply")))
    height, width = read_mask(source / "mask.png").shape
    return _write_diligent(source, folder, name, (width, height), (width / 2, height / 2), mesh)


def plane(data: Path, folder: Path, name: str) -> Path:
    """Write "yellow_box" or "card_blue": nine telephone photos of a flat sample with the flash
    beside the lens, whose place is refined. Returns the capture file."""
    source = (data / "real" / "flash_plane" / name).resolve()
    lines = ["[scan]", f'cameras = "{source / "colmap"}"', f'mesh = "{source / "plane.obj"}"']
    lines += ["[fit]", "absolute = false"]
    lines += ["[[light]]", 'name = "flash"', "mounted = [0, 0, 0]", "refine = true"]
    for lit in sorted(p for p in source.glob("*.png") if p.stem.isdigit()):
        lines += ["[[photo]]", f'file = "{lit}"', f'camera = "{lit.name}"', 'light = "flash"']
        lines += ["exposure = 1"]
    return _write(folder / f"{name}.capture.toml", lines)


def ball(data: Path, folder: Path, change: Callable[[Mesh], Mesh] | None = None) -> Path:
    """Write the DiLiGenT ball: a sphere in orthographic view along z, with 24 distant lights.

    One unit is one pixel; x right, y up, z to the camera, as in its files. Intensities are relative
    to each other, so that the BRDF is known up to a scale. change: as in ``diligent``. Returns the
    capture file.
    """
    source = (data / "real" / "diligent_ball").resolve()
    from patina.core.photo import read_mask  # the package is loaded by the caller

    mask = read_mask(source / "mask.png")
    height, width = mask.shape
    rows, columns = np.nonzero(mask)
    cx, cy = columns.mean() + 0.5, rows.mean() + 0.5
    radius = float(np.sqrt(mask.sum() / np.pi))
    mesh = folder / "ball.ply"
    _write_sphere(mesh, radius)
    if change is not None:
        from patina.core.scan.mesh import read_mesh

        _write_mesh(mesh, change(read_mesh(mesh)))
    return _write_diligent(source, folder, "ball", (width, height), (cx, cy), mesh)


def _write_diligent(
    source: Path,
    folder: Path,
    label: str,
    size: tuple[int, int],
    centre: tuple[float, float],
    mesh: Path,
) -> Path:
    """Write a capture of the photos in ``source``. size: width and height; centre: the pixel that
    the z axis meets."""
    camera = {
        "label": label, "width": size[0], "height": size[1], "model": "ORTHOGRAPHIC",
        "parameters": [1.0, 1.0, *centre], "rotation": np.diag([1.0, -1.0, -1.0]).tolist(),
        "translation": [0.0, 0.0, 10.0 * max(size)], "photo": None,
    }  # fmt: skip
    cameras = {"patina_cameras": 1, "frame": "mesh", "cameras": [camera]}
    (folder / f"{label}.cameras.json").write_text(json.dumps(cameras))
    lines = ["[scan]", f'cameras = "{label}.cameras.json"', f'mesh = "{mesh}"']
    lines += ["[tone]", 'transfer = "linear"', "[fit]", "absolute = false"]
    lines += ["[[material]]", f'name = "{label}"']
    directions = np.loadtxt(source / "light_directions.txt")
    intensities = np.loadtxt(source / "light_intensities.txt")
    names = (source / "filenames.txt").read_text().split()
    photos = []
    for name, direction, intensity in zip(names, directions, intensities, strict=True):
        lines += ["[[light]]", f'name = "{name}"', f"direction = {direction.tolist()}"]
        lines += [f"irradiance = {intensity.tolist()}"]
        photos += ["[[photo]]", f'file = "{source / name}"', f'camera = "{label}"']
        photos += [f'light = "{name}"', f'masks = {{{label} = "{source / "mask.png"}"}}']
    return _write(folder / f"{label}.capture.toml", lines + photos)


def _write_mesh(path: Path, mesh: Mesh) -> None:
    import trimesh

    trimesh.Trimesh(mesh.vertices, mesh.faces, process=False).export(path)


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
