"""Create the demo capture in assets/demo: `python -m tools.make_demo [FOLDER]`, with the bpy wheel.

A modelled jar (demo_shape) is rendered in Cycles (demo_render). Noise is added to the photos, and
reconstruction errors to the mesh and the poses. The same seed gives the same capture.
"""

from __future__ import annotations

import argparse
import json
import shutil
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np
import OpenImageIO as oiio
import pycolmap
from scipy.ndimage import binary_dilation, binary_erosion
from scipy.spatial.transform import Rotation

from .common import ROOT
from .demo_render import (
    CLAY,
    GLAZE,
    Camera,
    Occluder,
    Studio,
    decimated,
    identity,
    lambertian,
    plane,
    pottery,
)
from .demo_shape import (
    Array,
    Field,
    Surface,
    glaze_depth,
    gradient,
    make_field,
    mesh_of,
    vertex_normals,
)

SEED = 2018
IRRADIANCE = float(np.pi)
"""Irradiance of every lamp at the middle of the jar, at normal incidence: a white Lambertian
surface has radiance 1 there."""

LAMP_DISTANCE = 4.0
"""Scan units between the middle of the jar and each lamp: 1.2 m if the jar is 30 cm tall. The
capture file calls the lamps distant, as an artist would without a tape measure."""

DRIFTED = {"view_15.jpg": 1.12}
"""Camera → factor on the exposure of its photo, which the capture file does not mention."""

LAMPS = {
    "key": (84.0, 28.0, ("view_03.jpg", "view_20.jpg")),
    "side": (264.0, 22.0, ("view_15.jpg", "view_18.jpg")),
    "rim": (168.0, 22.0, ("view_08.jpg", "view_02.jpg")),
    "back": (330.0, 10.0, ("view_13.jpg", "view_06.jpg")),
}
"""Lamp → azimuth and elevation in degrees, and the cameras of its two photos, which see much of the
lit side, at about 25°, 60°, 95° and 130° from the lamp."""

SIZE, FOCAL, CENTRE = (384, 430), 1243.0, (196.3, 210.8)
MIDDLE = np.array([0.0, 0.0, 0.492])
POSE_ERROR = 0.07  # pixels, both of rotation and of translation of the camera
SHOT, READ = 0.010, 0.0015  # noise: sqrt((SHOT²)·L·0.5 + READ²) at radiance L, so 1 % at L = 0.5
SCAN_FACES, SCAN_CELL, TRUE_CELL = 25000, 0.007, 0.005
MARGIN = 6  # pixels around the object; photos are black outside, for small files
SCAN_NOISE = 0.00036  # scan units, standard deviation of the mesh's error along the normal


@dataclass(frozen=True)
class Shot:
    """A lit photo: its camera and lamp."""

    camera: str
    lamp: str


def on_sphere(azimuth: float, elevation: float) -> Array:
    """Return a unit vector in the frame of the object, from angles in degrees."""
    a, e = np.radians([azimuth, elevation])
    return np.array([np.cos(e) * np.cos(a), np.cos(e) * np.sin(a), np.sin(e)])


def angle(a: Array, b: Array) -> float:
    """Return the angle between two unit vectors in degrees."""
    return float(np.degrees(np.arccos(np.clip(a @ b, -1, 1))))


def scan_cameras(rng: np.random.Generator, turn: Array) -> dict[str, Camera]:
    """Return 24 cameras in three rings around the object, hand-held; `turn` is scan ← object."""
    cameras = {}
    for count, elevation, start in ((11, 8.0, 3.0), (8, 30.0, 20.0), (5, 54.0, 10.0)):
        for i in range(count):
            azimuth = start + 360.0 * i / count + rng.normal(0, 2.5)
            away = on_sphere(azimuth, elevation + rng.normal(0, 2.0))
            position = MIDDLE + 3.2 * (1 + rng.normal(0, 0.004)) * away
            forward = MIDDLE + rng.normal(0, 0.006, 3) - position
            forward /= np.linalg.norm(forward)
            right = np.cross(forward, [0.0, 0.0, 1.0])
            right /= np.linalg.norm(right)
            level = np.stack([right, np.cross(forward, right), forward])
            rolled = Rotation.from_euler("z", rng.normal(0, 1.2), degrees=True).as_matrix() @ level
            rotation = rolled @ turn.T
            camera = Camera(rotation, -rolled @ position, FOCAL, CENTRE, SIZE)
            cameras[f"view_{len(cameras):02d}.jpg"] = camera
    return cameras


def reconstructed(rng: np.random.Generator, mesh: Surface) -> Array:
    """Return the points of the mesh with errors of dense stereo: smoothed creases, smooth noise."""
    points = mesh.points.copy()
    pairs = np.concatenate([mesh.triangles[:, [a, b]] for a, b in ((0, 1), (1, 2), (2, 0))])
    degree = np.bincount(pairs[:, 0], minlength=len(points))
    for weight in (0.45, -0.30):  # Taubin smoothing, which keeps the volume
        total = [np.bincount(pairs[:, 0], points[pairs[:, 1], d], len(points)) for d in range(3)]
        points = points + weight * (np.stack(total, -1) / degree[:, None] - points)
    waves = 600
    heading = rng.normal(size=(waves, 3))
    heading /= np.linalg.norm(heading, axis=-1, keepdims=True)
    length = np.exp(rng.uniform(np.log(0.07), np.log(0.28), waves))
    phase = rng.uniform(0, 2 * np.pi, waves)
    weights = (length / length.mean()) ** 0.5 * np.sqrt(2.0 / waves)
    bumps = np.cos(2 * np.pi * points @ (heading / length[:, None]).T + phase) @ weights
    return points + SCAN_NOISE * bumps[:, None] * mesh.normals


def normal_errors(field: Field, points: Array, triangles: Array, count: int = 40000) -> Array:
    """Return angles in degrees between smooth normals of a mesh and of the object, by area."""
    rng = np.random.default_rng(0)
    a, b, c = (points[triangles[:, i]] for i in range(3))
    area = np.linalg.norm(np.cross(b - a, c - a), axis=-1)
    drawn = triangles[rng.choice(len(triangles), count, p=area / area.sum())]
    weights = rng.dirichlet([1.0, 1.0, 1.0], count)[:, :, None]
    normals = (weights * vertex_normals(points, triangles)[drawn]).sum(1)
    at = (weights * points[drawn]).sum(1)
    for _ in range(3):
        slope = gradient(field, at)
        at = at - (field(at) / np.maximum((slope**2).sum(-1), 0.05))[:, None] * slope
    slope = gradient(field, at)
    length = np.linalg.norm(normals, axis=-1) * np.linalg.norm(slope, axis=-1)
    return np.degrees(np.arccos(np.clip((normals * slope).sum(-1) / length, -1, 1)))


def write_ply(path: Path, points: Array, triangles: Array) -> None:
    """Write a binary PLY without normals."""
    rows = np.empty(len(triangles), dtype=[("n", "u1"), ("v", "<i4", 3)])
    rows["n"], rows["v"] = 3, triangles
    header = (
        "ply\nformat binary_little_endian 1.0\ncomment Patina demo capture, CC0\n"
        f"element vertex {len(points)}\nproperty float x\nproperty float y\nproperty float z\n"
        f"element face {len(triangles)}\nproperty list uchar int vertex_indices\nend_header\n"
    )
    path.write_bytes(header.encode() + points.astype("<f4").tobytes() + rows.tobytes())


def disturbed(rng: np.random.Generator, camera: Camera) -> Camera:
    """Return a camera with the pose error of a good bundle adjustment."""
    turn = Rotation.from_rotvec(rng.normal(0, POSE_ERROR / FOCAL, 3)).as_matrix()
    shift = rng.normal(0, POSE_ERROR / FOCAL * 3.2, 3)
    rotation = turn @ camera.rotation
    return replace(camera, rotation=rotation, translation=turn @ camera.translation + shift)


def write_colmap(
    rng: np.random.Generator, folder: Path, cameras: Mapping[str, Camera], mesh: Surface
) -> None:
    """Write a sparse model: the cameras, and points of the mesh that three or more cameras see."""
    model = pycolmap.Reconstruction()
    width, height = SIZE
    model.add_camera_with_trivial_rig(
        pycolmap.Camera(
            model="PINHOLE", width=width, height=height, params=[FOCAL, FOCAL, *CENTRE], camera_id=1
        )
    )
    occluder = Occluder(mesh)
    selected = rng.choice(len(mesh.points), 900, replace=False)
    keypoints: dict[str, list[Array]] = {name: [] for name in cameras}
    tracks: list[list[tuple[str, int]]] = [[] for _ in selected]
    for name, camera in cameras.items():
        pixels = camera.project(mesh.points[selected])
        for track, index, pixel in zip(tracks, selected, pixels, strict=True):
            point, normal = mesh.points[index], mesh.normals[index]
            away = camera.position - point
            away /= np.linalg.norm(away)
            if away @ normal < 0.35 or rng.random() < 0.4:
                continue
            if occluder.free(point + 0.004 * normal, away):
                track.append((name, len(keypoints[name])))
                keypoints[name].append(pixel + rng.normal(0, 0.25, 2))
    ids = {}
    for number, (name, camera) in enumerate(cameras.items(), start=1):
        ids[name] = number
        image = pycolmap.Image(
            name=name, keypoints=np.array(keypoints[name]), camera_id=1, image_id=number
        )
        pose = pycolmap.Rigid3d(pycolmap.Rotation3d(camera.rotation), camera.translation)
        model.add_image_with_trivial_frame(image, pose)
    for track, index in zip(tracks, selected, strict=True):
        if len(track) >= 3:
            elements = [pycolmap.TrackElement(ids[name], i) for name, i in track]
            glazed = glaze_depth((mesh.points[index] @ scan_turn())[None])[0] > 0
            colour = np.array([20, 110, 118] if glazed else [182, 127, 90], dtype=np.uint8)
            model.add_point3D(mesh.points[index], pycolmap.Track(elements), colour)
    model.update_point_3d_errors()
    folder.mkdir(parents=True)
    model.write_binary(str(folder))


def scan_turn() -> Array:
    """Return the rotation object → scan, arbitrary as in structure from motion."""
    return Rotation.from_euler("xyz", [-118.0, 17.0, 41.0], degrees=True).as_matrix()


def exposed(rng: np.random.Generator, radiance: Array) -> Array:
    """Return the radiance with shot and read noise, quantised to half of the noise or less.

    The steps are powers of two, as in compressed raw files of cameras. They make the files small;
    their rounding error is at most a seventh of the noise.
    """
    noise = np.sqrt(SHOT**2 * 0.5 * np.maximum(radiance, 0) + READ**2)
    seen = radiance + noise * rng.normal(size=radiance.shape)
    step = 2.0 ** np.floor(np.log2(noise / 2))
    return np.round(seen / step) * step


def developed(rng: np.random.Generator, radiance: Array, coverage: Array) -> Array:
    """Return the photo of a radiance, black beyond MARGIN pixels around the object."""
    near = binary_dilation(coverage > 0, iterations=MARGIN)
    return np.where(near[..., None], exposed(rng, radiance), 0.0)


def print_size(folder: Path) -> None:
    """Print how large the files of a folder are together."""
    total = sum(path.stat().st_size for path in folder.rglob("*") if path.is_file())
    print(f"{folder.name}: {total / 1e6:.2f} MB")


def write_exr(path: Path, pixels: Array) -> None:
    """Write linear RGB (height, width, 3) as half floats."""
    write_image(path, np.asarray(pixels, np.float32), "half")


def write_mask(path: Path, inside: Array) -> None:
    """Write a boolean (height, width) as an 8-bit PNG, white = inside."""
    write_image(path, (inside * np.uint8(255))[..., None], "uint8")


def write_image(path: Path, pixels: Array, kind: str) -> None:
    """Write (height, width, channels); EXR is compressed without loss."""
    height, width, channels = pixels.shape
    spec = oiio.ImageSpec(width, height, channels, kind)
    if path.suffix == ".exr":
        spec.attribute("compression", "zip")
        spec.attribute("DateTime", "2000:01:01 00:00:00")  # instead of the current time
    out = oiio.ImageOutput.create(str(path))
    if not out.open(str(path), spec) or not out.write_image(np.ascontiguousarray(pixels)):
        raise OSError(f"{path}: {out.geterror()}")
    out.close()


def masks_of(coverage: Array) -> dict[str, Array]:
    """Return masks like an artist's from an identity render, without pixels near borders."""
    whole = coverage[..., 3] > 0.999
    square = np.ones((3, 3), bool)
    masks = {}
    for name, own, other in (("glaze", 0, 1), ("clay", 1, 0)):
        near = binary_dilation(coverage[..., other] > 0.001, square, iterations=2)
        inside = binary_erosion(whole & (coverage[..., own] > 0.999), square)
        masks[name] = inside & ~near
    return masks


def toml(lamps: Mapping[str, Array], shots: Sequence[Shot]) -> str:
    """Return the text of the capture file."""
    lines = ["# The demo capture: made by tools/make_demo.py, see README.md beside it.", ""]
    lines += ["[scan]", 'cameras = "sparse"', 'mesh = "mesh.ply"', ""]
    for name, direction in lamps.items():
        x, y, z = direction
        lines += ["[[light]]", f'name = "{name}"', f"direction = [{x:.6f}, {y:.6f}, {z:.6f}]"]
        lines += [f"irradiance = [{', '.join([f'{IRRADIANCE:.6f}'] * 3)}]", ""]
    for shot in shots:
        stem = Path(shot.camera).stem
        lines += ["[[photo]]", f'file = "lit/{stem}.exr"', f'camera = "{shot.camera}"']
        masks = ", ".join(f'{name} = "masks/{stem}_{name}.png"' for name in ("glaze", "clay"))
        lines += [f'light = "{shot.lamp}"', f"masks = {{{masks}}}", ""]
    lines += ["[[material]]", 'name = "glaze"', "", "[[material]]", 'name = "clay"', ""]
    return "\n".join(lines)


def truth(lamps: Mapping[str, Array], shots: Sequence[Shot], angles: Sequence[float]) -> str:
    """Return the text of truth.json."""
    model = {"model": "Principled BSDF (Cycles, GGX), other inputs at their defaults"}
    centre = scan_turn() @ MIDDLE
    content = {
        "notice": "For checks only: nothing that fits or diagnoses may read this file.",
        "materials": {"glaze": {**model, **GLAZE}, "clay": {**model, **CLAY}},
        "lights": {name: direction.tolist() for name, direction in lamps.items()},
        "irradiance": IRRADIANCE,
        "lamp_distance": LAMP_DISTANCE,
        "lamp_positions": {
            name: (centre + LAMP_DISTANCE * direction).round(6).tolist()
            for name, direction in lamps.items()
        },
        "transport": "direct light and cast shadows; no interreflection, no ambient light",
        "photos": [
            {
                "file": f"lit/{Path(s.camera).stem}.exr",
                "light": s.lamp,
                "angle": round(a, 2),
                "exposure": DRIFTED.get(s.camera, 1.0),
            }
            for s, a in zip(shots, angles, strict=True)
        ],
        "background": f"black beyond {MARGIN} pixels around the object",
        "noise": {"sigma": "sqrt(shot^2 * 0.5 * L + read^2)", "shot": SHOT, "read": READ},
        "mesh": {"normal_error": "smooth, about 1 degree median", "sigma": SCAN_NOISE},
        "scan_from_object": scan_turn().round(9).tolist(),
        "seed": SEED,
    }
    return json.dumps(content, indent=1) + "\n"


def check_irradiance(studio: Studio, camera: Camera, direction: Array) -> None:
    """Raise RuntimeError unless a white Lambertian plane facing the lamp has radiance E/π."""
    centre = scan_turn() @ MIDDLE
    studio.show(plane(centre, direction), np.zeros(4))
    studio.dress(lambertian())
    studio.near(centre + LAMP_DISTANCE * direction, IRRADIANCE, centre)
    middle = studio.photograph(camera)[195:235, 172:212, :3]
    print(f"white plane facing the lamp: {middle.mean():.6f}, E/π = {IRRADIANCE / np.pi:.6f}")
    if (
        abs(middle.mean() - IRRADIANCE / np.pi) > 1e-3
    ):  # the lamp is near: the plane is 0.1 % darker 0.13 units off its middle
        raise RuntimeError("the irradiance of the lamp differs from that of the capture")


def make(folder: Path) -> None:
    """Write all files but README.md to `folder`, replacing existing ones."""
    for part in ("lit", "masks", "sparse"):
        shutil.rmtree(folder / part, ignore_errors=True)
    for part in ("lit", "masks"):
        (folder / part).mkdir(parents=True)
    rng = np.random.default_rng(SEED)
    turn, field = scan_turn(), make_field()
    cameras = scan_cameras(rng, turn)
    lamps = {name: np.round(turn @ on_sphere(a, e), 6) for name, (a, e, _) in LAMPS.items()}
    shots = [Shot(view, name) for name, (_, _, views) in LAMPS.items() for view in views]

    coarse = decimated(mesh_of(field, SCAN_CELL), SCAN_FACES)
    points = reconstructed(rng, coarse)
    off = normal_errors(field, points, coarse.triangles)
    percentiles = ", ".join(f"{q} %: {np.percentile(off, q):.2f}°" for q in (50, 75, 90, 95))
    print(f"scan: {len(coarse.triangles)} faces, percentiles of normal errors ({percentiles})")
    write_ply(folder / "mesh.ply", points @ turn.T, coarse.triangles)
    noisy = {name: disturbed(rng, camera) for name, camera in cameras.items()}
    scanned = Surface(points @ turn.T, coarse.triangles, coarse.normals @ turn.T)
    write_colmap(rng, folder / "sparse", noisy, scanned)

    fine = mesh_of(field, TRUE_CELL)
    body = Surface(fine.points @ turn.T, fine.triangles, fine.normals @ turn.T)
    glazed = glaze_depth(fine.points)
    studio = Studio()
    facing = cameras[shots[0].camera]
    check_irradiance(studio, facing, lamps[shots[0].lamp])
    studio.show(body, glazed)
    angles = []
    for shot in shots:
        camera, stem = cameras[shot.camera], Path(shot.camera).stem
        view = camera.position - turn @ MIDDLE
        angles.append(angle(lamps[shot.lamp], view / np.linalg.norm(view)))
        centre = turn @ MIDDLE
        studio.near(centre + LAMP_DISTANCE * lamps[shot.lamp], IRRADIANCE, centre)
        studio.dress(pottery())
        picture = studio.photograph(camera)
        radiance = picture[..., :3] * DRIFTED.get(shot.camera, 1.0)
        photo = developed(rng, radiance, picture[..., 3])
        write_exr(folder / "lit" / f"{stem}.exr", photo)
        studio.dress(identity())
        masks = masks_of(studio.photograph(camera))
        for name, inside in masks.items():
            write_mask(folder / "masks" / f"{stem}_{name}.png", inside)
        lit = radiance.max(-1) > 0.02
        shares = ", ".join(
            f"{n} {m.mean():.0%} (lit {(m & lit).mean():.0%})" for n, m in masks.items()
        )
        print(f"{stem}: {shot.lamp} {angles[-1]:.1f}°, brightest {radiance.max():.1f}, {shares}")
    (folder / "demo.capture.toml").write_text(toml(lamps, shots), encoding="utf-8")
    (folder / "truth.json").write_text(truth(lamps, shots, angles), encoding="utf-8")
    print_size(folder)


if __name__ == "__main__":
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("folder", nargs="?", type=Path, default=ROOT / "assets" / "demo")
    make(parser.parse_args().folder)
