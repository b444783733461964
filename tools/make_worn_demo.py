"""Create the second demo in assets/worn: `python -m tools.make_worn_demo [FOLDER]`, with the bpy
wheel.

The jar of the first demo (tools/make_demo.py) as worn, painted tin: the same scan, other photos.
JPEGs as a camera writes them, under distant lamps. The same seed gives the same capture.
"""

from __future__ import annotations

import argparse
import shutil
from pathlib import Path

import numpy as np
import OpenImageIO as oiio

from .common import ROOT
from .demo_render import Studio
from .demo_shape import Array, Surface, make_field, mesh_of
from .demo_worn import convexity, worn_finish
from .make_demo import (
    MIDDLE,
    SEED,
    TRUE_CELL,
    developed,
    on_sphere,
    print_size,
    scan_cameras,
    scan_turn,
)
from .objects.coat import coated

IRRADIANCE = 1.7  # of every lamp, at normal incidence
PHOTOS_OF_LAMP = 4  # by cameras all around
LAMPS = {
    "left": (20.0, 35.0), "back": (80.0, 20.0), "right": (140.0, 55.0),
    "front": (200.0, 30.0), "low": (260.0, 8.0), "high": (320.0, 65.0),
}  # fmt: skip
"""Azimuth and elevation in degrees."""

QUALITY = 95  # of the JPEGs


def chosen(views: dict[str, Array], lamps: dict[str, Array]) -> dict[str, list[str]]:
    """The cameras of each lamp: every camera is used once, by the lamp that needs it and lights
    what it sees. views: camera → unit vector to it; lamps: name → unit vector."""
    order = sorted(views)
    found: dict[str, list[str]] = {name: [] for name in lamps}
    for _ in range(PHOTOS_OF_LAMP):
        for name, towards in lamps.items():
            wanted = (30.0, 60.0, 85.0, 105.0)[len(found[name])]
            best = min(order, key=lambda v: abs(np.degrees(np.arccos(views[v] @ towards)) - wanted))
            found[name].append(best)
            order.remove(best)
    return found


def write_jpeg(path: Path, radiance: Array) -> None:
    """Write linear RGB as an 8-bit sRGB JPEG without reduced colour resolution."""
    linear = np.clip(radiance, 0.0, 1.0)
    curve = np.where(linear < 0.0031308, 12.92 * linear, 1.055 * linear ** (1 / 2.4) - 0.055)
    pixels = np.round(255 * curve).astype(np.uint8)
    spec = oiio.ImageSpec(pixels.shape[1], pixels.shape[0], 3, "uint8")
    spec.attribute("compression", f"jpeg:{QUALITY}")
    spec.attribute("jpeg:subsampling", "4:4:4")
    out = oiio.ImageOutput.create(str(path))
    if not out.open(str(path), spec) or not out.write_image(pixels):
        raise OSError(f"{path}: {out.geterror()}")
    out.close()


def toml(lamps: dict[str, Array], shots: dict[str, list[str]]) -> str:
    """The text of the capture file."""
    lines = ["# The second demo: made by tools/make_worn_demo.py, see README.md beside it.", ""]
    lines += ["[scan]", 'cameras = "../demo/sparse"', 'mesh = "../demo/mesh.ply"', ""]
    for name, (x, y, z) in lamps.items():
        lines += ["[[light]]", f'name = "{name}"', f"direction = [{x:.6f}, {y:.6f}, {z:.6f}]"]
        lines += [f"irradiance = [{IRRADIANCE}, {IRRADIANCE}, {IRRADIANCE}]", ""]
    for name, views in shots.items():
        for view in views:
            lines += ["[[photo]]", f'file = "lit/{view}"', f'camera = "{view}"']
            lines += [f'light = "{name}"', ""]
    lines += ["[[material]]", 'name = "jar"', ""]
    return "\n".join(lines)


def make(folder: Path) -> None:
    """Write all files but README.md to `folder`, replacing existing ones."""
    shutil.rmtree(folder / "lit", ignore_errors=True)
    (folder / "lit").mkdir(parents=True)
    turn = scan_turn()
    cameras = scan_cameras(np.random.default_rng(SEED), turn)  # those of the first demo
    rng = np.random.default_rng(SEED + 1)
    fine = mesh_of(make_field(), TRUE_CELL)
    body = Surface(fine.points @ turn.T, fine.triangles, fine.normals @ turn.T)
    studio = Studio()
    studio.show(body, np.zeros(len(fine.points)))
    finish = worn_finish(fine.points, convexity(fine))
    studio.dress(coated(studio.body, finish))
    shares = np.bincount(finish.kind, minlength=3) / len(finish.kind)
    print("paint {:.0%}, metal {:.0%}, dirt {:.0%} of the points".format(*shares))
    lamps = {name: np.round(turn @ on_sphere(a, e), 6) for name, (a, e) in LAMPS.items()}
    views = {name: camera.position - turn @ MIDDLE for name, camera in cameras.items()}
    views = {name: v / np.linalg.norm(v) for name, v in views.items()}
    shots = chosen(views, lamps)
    for name, own in shots.items():
        for view in own:
            studio.light(lamps[name], IRRADIANCE)
            picture = studio.photograph(cameras[view])
            photo = developed(rng, picture[..., :3], picture[..., 3])
            write_jpeg(folder / "lit" / view, photo)
            angle = np.degrees(np.arccos(views[view] @ lamps[name]))
            full = (photo.max(axis=-1) >= 1.0).sum() / max((picture[..., 3] > 0).sum(), 1)
            print(f"{view}: {name} {angle:.0f}°, clipped {full:.1%}")
    (folder / "worn.capture.toml").write_text(toml(lamps, shots), encoding="utf-8")
    print_size(folder)


if __name__ == "__main__":
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("folder", nargs="?", type=Path, default=ROOT / "assets" / "worn")
    make(parser.parse_args().folder)
