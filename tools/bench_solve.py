"""Measure pose errors, for rendered photos and for a real capture (leave one out)."""

from __future__ import annotations

import tempfile
from collections.abc import Sequence
from pathlib import Path

import numpy as np

# Pose of the chart photo, camera to chunk, from the README of the data (solved with more photos)
CHART = """0.994922831 -0.0166604036 -0.0992521614 -0.839992538
-0.0189328288 -0.999578736 -0.0219976919 -0.18724838
-0.0988438597 0.0237651301 -0.994819134 1.36802745 0 0 0 1"""
VIEWS = 24


def run(data: Path) -> None:
    """Print the tables of docs/guide/solve.md."""
    print("## solve\n")
    _rendered()
    _real(data / "real" / "rodin_bronze")


def _rendered() -> None:
    from patina.core.scan import Camera, Pose
    from patina.core.scan.mesh import read_mesh
    from patina.core.scan.readers.colmap import read_colmap
    from patina.core.solve import LocaliseJob, SolveJob
    from tests import make_photos_of_scene as made
    from tests.core.test_solve_scene import similarity

    def exact(label: str, view: made.View) -> Camera:
        pose = Pose(view.rotation, view.translation)
        lens = (made.FOCAL, *made.PRINCIPAL)
        return Camera(label, made.WIDTH, made.HEIGHT, "SIMPLE_PINHOLE", lens, pose)

    with tempfile.TemporaryDirectory(prefix="patina-bench-") as room:
        photos, lit = Path(room) / "photos", Path(room) / "lit"
        photos.mkdir()
        lit.mkdir()
        truth = [exact(f"{i:02d}.jpg", view) for i, view in enumerate(made.ring(VIEWS))]
        for i, view in enumerate(made.ring(VIEWS)):
            made.write_picture(photos / f"{i:02d}.jpg", made.photo(view, seed=i))
        lamps = ((0.5, -0.3, -0.8), (-0.8, -0.4, -0.4), (0.6, 0.5, -0.6), (0.0, -0.5, -0.9))
        lit_truth = []
        for i, view in enumerate(made.ring(len(lamps), heights=(0.55,), start=0.13)):
            shown = made.photo(view, view.rotation.T @ np.array(lamps[i]), seed=100 + i)
            made.write_picture(lit / f"lit_{i}.jpg", shown)
            lit_truth.append(exact(f"lit_{i}.jpg", view))
        made.write_mesh(Path(room) / "mesh.ply")
        mesh = read_mesh(Path(room) / "mesh.ply")
        job = SolveJob(photos)
        job.drain()
        job.solution.write(Path(room), Path(room), photos)
        found = read_colmap(Path(room) / "sparse").cameras
        scale, turn, shift = similarity(
            np.array([c.pose.centre for c in found]), np.array([c.pose.centre for c in truth])
        )
        moved = []
        for camera in found:
            rotation = camera.pose.rotation @ turn.T
            centre = scale * turn @ camera.pose.centre + shift
            moved.append(
                Camera(
                    camera.label, camera.width, camera.height, camera.model, camera.parameters,
                    Pose(rotation, -rotation @ centre),
                )
            )  # fmt: skip
        print(f"rendered, {VIEWS} views of 640 × 480: {job.solution.summary()}\n")
        _table()
        _row("solve", moved, truth, mesh.vertices, "")
        again = LocaliseJob(truth, photos, sorted(lit.glob("*.jpg")), mesh)
        again.drain()
        result = again.result
        stated_degrees = np.degrees(np.median([p.angle_deviation for p in result.placed]))
        note = f"{len(result.placed)} of {len(lamps)} placed; stated {stated_degrees:.3f}°"
        cameras = [p.camera for p in result.placed]
        by_label = {c.label: c for c in lit_truth}
        _row("localise", cameras, [by_label[c.label] for c in cameras], mesh.vertices, note)
    print()


def _real(folder: Path) -> None:
    from patina.core.geometry import RayScene
    from patina.core.scan import Camera, Pose
    from patina.core.scan.formats import read_reconstruction
    from patina.core.scan.mesh import read_mesh
    from patina.core.solve.landmarks import OnMesh
    from patina.core.solve.localise import Localised, Unsupported, localise
    from patina.core.solve.localise_job import features_of
    from patina.core.solve.scan_photos import scan_photos

    known = read_reconstruction(folder / "cameras.xml", folder / "photos")
    photos, _ = scan_photos(known.cameras, folder / "photos")
    mesh = read_mesh(folder / "mesh.ply")
    lift = OnMesh(RayScene.build(mesh))
    found = [features_of(photo.path) for photo in photos]
    marks = [lift.lift(p.camera, f) for p, f in zip(photos, found, strict=True)]

    def place(path: Path, features: object, others: Sequence[int]) -> Localised | None:
        scan = [photos[i] for i in others]
        lens = [scan[0].camera]
        try:
            return localise(
                path, features, lens, scan, range(len(scan)), lambda i: marks[others[i]], lift
            )
        except Unsupported:
            return None

    placed, truth = [], []
    for i, photo in enumerate(photos):
        result = place(photo.path, found[i], [j for j in range(len(photos)) if j != i])
        if result is not None:
            placed.append(result)
            truth.append(photo.camera)
    print(f"rodin_bronze, {len(photos)} photos of a shoot of 171, each against the others:\n")
    _table()
    stated_degrees = np.degrees(np.median([p.angle_deviation for p in placed]))
    note = f"{len(placed)} of {len(photos)} placed; stated {stated_degrees:.3f}°"
    _row("leave one out", [p.camera for p in placed], truth, mesh.vertices, note)
    chart = folder / "colorchecker" / "231016_miaEURO_9505.jpg"
    result = place(chart, features_of(chart), range(len(photos)))
    if result is not None:
        matrix = np.array(CHART.split(), float).reshape(4, 4)
        rotation = matrix[:3, :3].T
        pose = Pose(rotation, -rotation @ matrix[:3, 3])
        camera = result.camera
        true_camera = Camera(
            "chart", camera.width, camera.height, camera.model, camera.parameters, pose
        )
        stated_degrees = np.degrees(result.angle_deviation)
        note = (
            f"{result.inliers} features; stated {stated_degrees:.3f}°, "
            f"{result.place_deviation:.4f} units"
        )
        _row("chart photo", [camera], [true_camera], mesh.vertices, note)
    print()


def _table() -> None:
    print("| | angle, degrees: median (max) | place, scan units | pixels | |")
    print("|---|---|---|---|---|")


def _row(name: str, cameras: Sequence, truth: Sequence, points: np.ndarray, note: str) -> None:
    """Print differences from the true cameras; pixels: median over points in both images."""
    angles, places, pixels = [], [], []
    for one, other in zip(cameras, truth, strict=True):
        turn = one.pose.rotation @ other.pose.rotation.T
        angles.append(np.degrees(np.arccos(np.clip((np.trace(turn) - 1) / 2, -1, 1))))
        places.append(np.linalg.norm(one.pose.centre - other.pose.centre))
        here, there = one.project(points[::20]), other.project(points[::20])
        with np.errstate(invalid="ignore"):
            seen = ((there >= 0) & (there < (other.width, other.height))).all(axis=1)
        pixels.append(np.nanmedian(np.linalg.norm(here - there, axis=1)[seen]))
    cells = (f"{np.median(x):.3g} ({np.max(x):.3g})" for x in (angles, places, pixels))
    print(f"| {name} | {' | '.join(cells)} | {note} |", flush=True)
