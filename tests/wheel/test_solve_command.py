"""`solve` and `localise` from the command line, and Solve Photos in Blender."""

from __future__ import annotations

import signal
import subprocess
import sys
import time
import tomllib
from itertools import islice
from pathlib import Path

import numpy as np
import pytest

from patina.core.scan.formats import read_reconstruction
from patina.core.scan.readers.colmap import read_colmap
from tests import make_photos_of_scene as made

pytestmark = [pytest.mark.blender, pytest.mark.slow]
VIEWS = 6


def headless(root: Path, *arguments: object) -> subprocess.CompletedProcess[str]:
    return subprocess.run(
        [sys.executable, root / "headless.py", *map(str, arguments)],
        capture_output=True,
        text=True,
        timeout=300,
    )


@pytest.fixture(scope="module")
def photos(tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("shoot") / "my photos"
    folder.mkdir()
    for i, view in enumerate(islice(made.ring(30, heights=(0.5,)), VIEWS)):
        made.write_picture(folder / f"photo {i}.jpg", made.photo(view, seed=i))
    return folder


@pytest.fixture(scope="module")
def solved(root: Path, photos: Path) -> Path:
    out = photos.parent / "out"
    done = headless(root, "solve", photos, "--out", out, "--threads", 2)
    assert done.returncode == 0, done.stderr
    for stage in ("finding features", "matching", "placing cameras"):
        assert stage in done.stderr
    assert f"{VIEWS} of {VIEWS} photos placed" in done.stdout
    return out


def test_solve_writes_model_and_capture(solved: Path, photos: Path) -> None:
    assert {p.name for p in solved.iterdir()} == {
        "sparse", "report.txt", "my photos.capture.toml", ".patina-files",
    }  # fmt: skip
    found = read_colmap(solved / "sparse")
    assert [c.label for c in found.cameras] == [f"photo {i}.jpg" for i in range(VIEWS)]
    data = tomllib.loads((solved / "my photos.capture.toml").read_text("utf-8"))
    assert (solved / data["scan"]["images"]).resolve() == photos.resolve()
    assert (solved / data["scan"]["cameras"]).is_dir()


def test_photo_is_localised_at_true_viewpoint(
    root: Path, solved: Path, photos: Path, tmp_path: Path
) -> None:
    """By the model's own points, without a mesh: another image from photo 2's viewpoint."""
    view = list(islice(made.ring(30, heights=(0.5,)), VIEWS))[2]
    lit = tmp_path / "lit 2.jpg"
    made.write_picture(lit, made.photo(view, view.rotation.T @ (0.4, -0.4, -0.8), seed=9))
    done = headless(
        root, "localise", solved / "sparse", "--images", photos, "--photos", lit,
        "--out", tmp_path / "out", "--threads", 2,
    )  # fmt: skip
    assert done.returncode == 0, done.stderr
    (camera,) = read_reconstruction(tmp_path / "out" / "localised.cameras.json").cameras
    assert camera.label == "lit 2.jpg"
    scan = read_colmap(solved / "sparse")
    same = next(c for c in scan.cameras if c.label == "photo 2.jpg")
    front = scan.points[np.isfinite(same.project(scan.points)).all(axis=1)]
    assert np.median(np.linalg.norm(camera.project(front) - same.project(front), axis=1)) < 0.5


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        (("solve", "gone", "--out", "out"), "no such folder"),
        (("solve", ".", "--out", "out"), "no photos"),
        (("solve", ".", "--out", "out", "--threads", "0"), "--threads"),
        (("localise", "gone", "--photos", "x.jpg", "--out", "out"), "x.jpg"),
    ],
)
def test_user_error_is_one_line(
    root: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, arguments: tuple, message: str
) -> None:
    monkeypatch.chdir(tmp_path)
    done = headless(root, *arguments)
    assert done.returncode == 2 and message in done.stderr
    assert len(done.stderr.strip().splitlines()) == 1
    assert not list(tmp_path.iterdir())


def test_interrupted_run_leaves_no_files(root: Path, photos: Path, tmp_path: Path) -> None:
    arguments = [sys.executable, root / "headless.py", "solve", photos, "--out", tmp_path / "out"]
    running = subprocess.Popen(arguments, stderr=subprocess.PIPE, text=True)
    assert running.stderr is not None
    assert any("features" in line for line in running.stderr)
    running.send_signal(signal.SIGTERM)
    begin = time.monotonic()
    _, message = running.communicate(timeout=60)
    assert running.returncode == 130 and "Interrupted" in message and "Traceback" not in message
    assert time.monotonic() - begin < 30
    assert not list(tmp_path.iterdir())


def test_operator_adds_cameras_and_points_to_scene(photos: Path, tmp_path: Path) -> None:
    import bpy

    import patina

    bpy.ops.wm.read_homefile(use_empty=True, use_factory_startup=True)
    patina.register()
    bpy.context.scene.patina_orientation.up_axis = "Z"  # centres are compared with the files
    try:
        done = bpy.ops.patina.solve_photos(
            directory=str(photos), out=str(tmp_path / "out"), threads=2
        )
        assert done == {"FINISHED"}
        cameras = [o for o in bpy.context.scene.objects if o.type == "CAMERA"]
        assert {o.name for o in cameras} == {f"photo {i}.jpg" for i in range(VIEWS)}
        found = read_colmap(tmp_path / "out" / "sparse")
        by_label = {c.label: c.pose.centre for c in found.cameras}
        for camera in cameras:
            assert np.allclose(camera.matrix_world.translation, by_label[camera.name], atol=1e-5)
        points = next(o for o in bpy.context.scene.objects if o.type in ("MESH", "POINTCLOUD"))
        assert len(points.data.attributes["position"].data) == len(found.points)
        with pytest.raises(RuntimeError, match="no photos"):
            bpy.ops.patina.solve_photos(directory=str(tmp_path / "out" / "sparse"))
    finally:
        patina.unregister()
