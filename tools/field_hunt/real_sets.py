"""Effects hidden in real photographs: photometric-stereo sets and samples under a phone's flash.

The honest captures state what their sources state; the owl's lights are those that the grey sphere
of the same set shows. With an effect, photos are changed in linear radiance and written anew with
the depth that they had, or the capture file states something wrong.
"""

from __future__ import annotations

import json
import shutil
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import OpenImageIO as oiio
import trimesh
from scipy.ndimage import binary_erosion

from .. import photometric_stereo
from ..experiments.materials import data_folder
from ..hunt import camera_faults
from ..hunt.scene import find_size, rms
from .make import CAPTURE, Truth, srgb, toml_numbers

Array = np.ndarray
Photos = list[Array]

DILIGENT = ("diligent_ball", "diligent_cat", "diligent_reading")
UW = ("grey_sphere", "owl")
PLANES = ("yellow_box", "card_blue")
DISTANT_SETS = (*DILIGENT, *UW)
EVERY = 3  # DiLiGenT photos: each third
SHADOW = (0.08, 0.2)  # semi-axes of a painted shadow, fractions of the object's size
DARK = 0.6  # of the light that it takes


@dataclass(frozen=True)
class RealSet:
    """photos: linear, 1 is the largest value that the file can hold. mask: (h, w) of the object,
    None where the mesh says. directions, strengths: (n, 3) of distant lights; None: a flash. depth:
    bits; encoded: whether the files are sRGB. write_scan: writes the scan, returns the lines of
    [scan]; cameras: name of each photo's camera."""

    photos: Photos
    mask: Array | None
    directions: Array | None
    strengths: Array | None
    depth: int
    encoded: bool
    write_scan: Callable[[Path], list[str]]
    cameras: Sequence[str]


def make_real(folder: Path, name: str, cause: str, strength: float, seed: int) -> Truth:
    """Write a capture of a real set to ``folder``. cause: "none" or a key of EFFECTS."""
    found = open_set(name)
    rng = np.random.default_rng([seed, 13])
    photos, directions, size, changed = found.photos, found.directions, 0.0, 0.0
    if cause == "light_direction":
        assert directions is not None
        size, changed, directions = _turned(found, strength, rng)
    elif cause != "none":
        apply, start = EFFECTS[cause](found, rng)
        size = find_size(lambda s: rms(apply(s), photos), start, strength)
        plain, photos = photos, apply(size)
        changed = rms(photos, plain)
    folder.mkdir(parents=True, exist_ok=True)
    _write(folder, found, photos, directions)
    lamp = "flash" if directions is None else "distant"
    encoding = "srgb" if found.encoded else "linear"
    return Truth(
        cause, strength, seed, lamp, name, name, f"{encoding} {found.depth}", True, changed,
        {"size": size},
    )  # fmt: skip


def _drift(found: RealSet, rng: np.random.Generator):  # type: ignore[no-untyped-def]
    drift = rng.standard_normal(len(found.photos))
    drift -= drift.mean()
    return lambda s: [p * np.exp(s * d) for p, d in zip(found.photos, drift, strict=True)], 0.05


def _curve(found: RealSet, rng: np.random.Generator):  # type: ignore[no-untyped-def]
    sign = rng.choice([-1.0, 1.0])
    return lambda s: camera_faults.tone(found.photos, 1 + sign * s), 0.05


def _corners(found: RealSet, rng: np.random.Generator):  # type: ignore[no-untyped-def]
    return lambda s: camera_faults.vignetted(found.photos, min(s, 0.95)), 0.1


def _veil(found: RealSet, rng: np.random.Generator):  # type: ignore[no-untyped-def]
    return lambda s: camera_faults.veiled(found.photos, min(s, 0.9)), 0.02


def _clipped(found: RealSet, rng: np.random.Generator):  # type: ignore[no-untyped-def]
    top = max(float(p.max()) for p in found.photos)
    return lambda s: [np.minimum(p, top / (1 + s)) for p in found.photos], 1.0


def _lifted(found: RealSet, rng: np.random.Generator):  # type: ignore[no-untyped-def]
    white = max(float(np.percentile(p, 99)) for p in found.photos)
    return lambda s: [p + s * white for p in found.photos], 0.02


def _painted_shadow(found: RealSet, rng: np.random.Generator):  # type: ignore[no-untyped-def]
    """A soft-edged ellipse in one photo, where the object is bright."""
    bright = sorted(range(len(found.photos)), key=lambda k: -found.photos[k].mean())
    which = int(rng.choice(bright[: len(bright) // 2]))
    photo = found.photos[which].mean(axis=2)
    inside = binary_erosion(photo > 0.3 * np.percentile(photo[photo > 0], 90), iterations=8)
    rows, columns = np.nonzero(inside if inside.any() else photo > 0)
    at = int(rng.integers(len(rows)))
    y, x = np.mgrid[: photo.shape[0], : photo.shape[1]]
    shape = rng.uniform(0.5, 1.0)

    def apply(size: float) -> Photos:
        wide = max(size, 1e-3) * max(photo.shape) * 0.3
        r = np.hypot((x - columns[at]) / wide, (y - rows[at]) / (wide * shape))
        dark = 1 - DARK / (1 + np.exp((r - 1) * wide / 1.5))
        return [p * dark[..., None] if k == which else p for k, p in enumerate(found.photos)]

    return apply, 0.3


EFFECTS: dict[str, Callable] = {  # type: ignore[type-arg]
    "light_intensity": _drift, "camera_response": _curve, "vignetting": _corners,
    "veiling_glare": _veil, "clipping": _clipped, "black_level": _lifted,
    "cast_shadow": _painted_shadow,
}  # fmt: skip
"""Cause → function that returns (photos of a size, first size)."""


def _turned(
    found: RealSet, strength: float, rng: np.random.Generator
) -> tuple[float, float, Array]:
    """(angle in radians, RMS change of Lambertian photos, wrong directions): the change is that of
    a sphere of the same material, without a measured surface: n·l changes by about the angle."""
    directions = found.directions
    assert directions is not None
    # a Lambertian hemisphere's RMS change for a small angle a is about 0.9 a
    angle = strength / 0.9
    out = []
    for towards in directions:
        side = np.cross(towards, rng.normal(size=3))
        moved = towards + np.tan(angle) * side / np.linalg.norm(side)
        out.append(moved / np.linalg.norm(moved))
    return angle, strength, np.array(out)


def open_set(name: str) -> RealSet:
    """One of DISTANT_SETS or PLANES, honest."""
    real = data_folder() / "real"
    if name in DILIGENT:
        return _diligent(real / name)
    if name in UW:
        return _uw(real / "psm_uw", name)
    return _plane(real / "flash_plane" / name)


def _pixels(path: Path) -> Array:
    return np.asarray(oiio.ImageBuf(str(path)).get_pixels(oiio.FLOAT), np.float64)[..., :3]


def _diligent(source: Path) -> RealSet:
    names = (source / "filenames.txt").read_text().split()[::EVERY]
    directions = np.loadtxt(source / "light_directions.txt")[::EVERY]
    strengths = np.loadtxt(source / "light_intensities.txt")[::EVERY]
    mask = np.asarray(oiio.ImageBuf(str(source / "mask.png")).get_pixels(oiio.FLOAT))[..., 0] > 0.5
    photos = [_pixels(source / one) for one in names]

    def write_scan(folder: Path) -> list[str]:
        given = source / "mesh_from_gt_normals.ply"
        if given.is_file():
            shutil.copy(given, folder / "mesh.ply")
            origin = (mask.shape[1] / 2, mask.shape[0] / 2)
        else:
            origin = _export_sphere(folder, mask)
        return _orthographic(folder, mask.shape, origin)

    return RealSet(
        photos, mask, directions, strengths, 16, False, write_scan, ["view"] * len(names)
    )


def _export_sphere(folder: Path, mask: Array) -> tuple[float, float]:
    mesh = photometric_stereo.sphere(mask)
    trimesh.Trimesh(mesh.vertices, mesh.faces, process=False).export(folder / "mesh.ply")
    return mask.shape[1] / 2, mask.shape[0] / 2


def _orthographic(folder: Path, shape: tuple[int, ...], origin: tuple[float, float]) -> list[str]:
    """x right, y up, z to the camera; one unit is one pixel."""
    camera = {
        "label": "view", "width": shape[1], "height": shape[0], "model": "ORTHOGRAPHIC",
        "parameters": [1.0, 1.0, *origin], "rotation": np.diag([1.0, -1.0, -1.0]).tolist(),
        "translation": [0.0, 0.0, 2000.0], "photo": None,
    }  # fmt: skip
    cameras = {"patina_cameras": 1, "frame": "mesh", "cameras": [camera]}
    (folder / "view.cameras.json").write_text(json.dumps(cameras))
    return ['cameras = "view.cameras.json"', 'mesh = "mesh.ply"']


def _uw(source: Path, name: str) -> RealSet:
    what = "gray" if name == "grey_sphere" else "owl"
    mask, photos = photometric_stereo.read(source / "data" / what, what)
    if name == "grey_sphere":
        directions = np.loadtxt(source / "lights_chrome_mine.txt").reshape(-1, 3)
        directions /= np.linalg.norm(directions, axis=1, keepdims=True)
    else:  # the stated ones are off by up to 5°, as the grey sphere under the same lights shows
        grey = photometric_stereo.read(source / "data" / "gray", "gray")
        directions = photometric_stereo.sphere_lights(*grey)

    def write_scan(folder: Path) -> list[str]:
        if name == "grey_sphere":
            origin = _export_sphere(folder, mask)
        else:
            normals = photometric_stereo.normals(mask, photos, directions)
            mesh = photometric_stereo.integrated(mask, normals)
            trimesh.Trimesh(mesh.vertices, mesh.faces, process=False).export(folder / "mesh.ply")
            origin = (mask.shape[1] / 2, mask.shape[0] / 2)
        return _orthographic(folder, mask.shape, origin)

    linear = [np.asarray(p, np.float64) for p in photos]
    return RealSet(linear, mask, directions, np.ones((len(photos), 3)), 8, False, write_scan,
                   ["view"] * len(photos))  # fmt: skip


def _plane(source: Path) -> RealSet:
    files = sorted(p for p in source.iterdir() if p.suffix in (".png", ".jpg") and p.stem.isdigit())
    photos = [_linear(_pixels(one)) for one in files]

    def write_scan(folder: Path) -> list[str]:
        shutil.copytree(source / "colmap", folder / "colmap", dirs_exist_ok=True)
        shutil.copy(source / "plane.obj", folder / "plane.obj")
        return ['cameras = "colmap"', 'mesh = "plane.obj"']

    return RealSet(photos, None, None, None, 8, True, write_scan, [one.name for one in files])


def _linear(encoded: Array) -> Array:
    return np.where(encoded <= 0.04045, encoded / 12.92, ((encoded + 0.055) / 1.055) ** 2.4)


def _write(folder: Path, found: RealSet, photos: Photos, directions: Array | None) -> None:
    lines = ["[scan]", *found.write_scan(folder), ""]
    if not found.encoded:
        lines += ["[tone]", 'transfer = "linear"']
    lines += ["[fit]", "absolute = false"]
    if directions is None:
        lines += ["[[light]]", 'name = "flash"', "mounted = [0, 0, 0]"]
    else:
        for k, towards in enumerate(directions):
            lines += [
                "[[light]]",
                f'name = "light {k + 1}"',
                f"direction = {toml_numbers(towards)}",
            ]
            if found.strengths is not None:
                lines += [f"irradiance = {toml_numbers(found.strengths[k])}"]
    if found.mask is not None:
        _write_png(folder / "object.png", np.repeat(found.mask[..., None], 3, axis=2) * 1.0, 8)
        lines += ["[[material]]", 'name = "object"']
    for k, image in enumerate(photos):
        name = f"photo_{k}.png"
        _write_png(
            folder / name, srgb(np.clip(image, 0, 1)) if found.encoded else image, found.depth
        )
        light = "flash" if directions is None else f"light {k + 1}"
        lines += ["[[photo]]", f'file = "{name}"', f'camera = "{found.cameras[k]}"']
        lines += [f'light = "{light}"', "exposure = 1"]
        if found.mask is not None:
            lines += ['masks = {object = "object.png"}']
    (folder / CAPTURE).write_text("\n".join(lines) + "\n", "utf-8")


def _write_png(path: Path, values: Array, depth: int) -> None:
    height, width, _ = values.shape
    spec = oiio.ImageSpec(width, height, 3, oiio.UINT8 if depth == 8 else oiio.UINT16)
    target = oiio.ImageBuf(spec)
    target.set_pixels(oiio.ROI(), np.ascontiguousarray(np.clip(values, 0, 1), np.float32))
    target.write(str(path))
