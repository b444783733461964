"""Photos with an exact answer: solved without prior information, then lit photos from new
viewpoints localised, with the true cameras and mesh as reference.
"""

from __future__ import annotations

import shutil
import time
import tomllib
from collections import Counter
from pathlib import Path

import numpy as np
import pycolmap
import pytest

from patina.core.errors import InputError, PatinaError
from patina.core.scan import Camera, Pose
from patina.core.scan.formats import read_reconstruction
from patina.core.scan.mesh import read_mesh
from patina.core.scan.readers.colmap import read_colmap
from patina.core.solve import LocaliseJob, SolveJob, find_photos
from patina.core.solve.solve import _full_disk_as_error
from tests import make_photos_of_scene as made

VIEWS = 14
# (direction to the light in the camera's frame, start angle on the orbit) of the lit photos
LIT_PHOTO_LIGHTS = (((0.5, -0.3, -0.8), 0.13), ((-0.6, -0.5, -0.6), 2.2))


def lit_views():
    for light, start in LIT_PHOTO_LIGHTS:
        (view,) = made.ring(1, heights=(0.55,), start=start)
        yield view, view.rotation.T @ np.array(light)


@pytest.fixture(scope="module")
def scene(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """photos/ (one as 16-bit TIFF, one EXR, one rotated by EXIF), lit/, mesh.ply."""
    folder = tmp_path_factory.mktemp("scene")
    photos, lit = folder / "photos", folder / "lit"
    (photos / "second round").mkdir(parents=True)
    lit.mkdir()
    for i, view in enumerate(made.ring(VIEWS)):
        radiance = made.photo(view, seed=i)
        name = f"view {i:02d}"
        if i == 3:
            made.write_pixels(photos / f"{name}.exr", (40 * radiance).astype(np.float32), "float")
        elif i == 5:
            encoded = np.clip(0.9 * radiance, 0, 1) ** (1 / 2.2)
            pixels = np.round(65535 * encoded).astype(np.uint16)
            made.write_pixels(photos / f"{name}.tif", pixels, "uint16")
        else:
            inside = photos / "second round" if i % 2 else photos
            turned = {"Orientation": 6} if i == 4 else {}
            made.write_picture(inside / f"{name}.jpg", radiance, **turned)
    for i, (view, light) in enumerate(lit_views()):
        made.write_picture(lit / f"lit_{i}.jpg", made.photo(view, light, seed=50 + i))
    made.write_mesh(folder / "mesh.ply")
    return folder


@pytest.fixture(scope="module")
def solved(scene: Path, tmp_path_factory: pytest.TempPathFactory) -> tuple[SolveJob, Path]:
    (scene / "photos" / "torn.jpg").write_bytes(b"\xff\xd8\xff\xe0 no picture")
    (scene / "photos" / "notes.txt").write_text("not a photo")
    job = SolveJob(scene / "photos", threads=2)
    fractions, stages = [], Counter()
    while job.step():
        fractions.append(job.now.fraction)
        stages[job.now.stage] += 1
    # the window stays responsive: no step waits for a stage, nor for more than a few photos
    assert stages["finding features"] > VIEWS // 2
    assert stages["matching"] > 3 and stages["placing cameras"] > 3
    assert fractions == sorted(fractions) and min(fractions) >= 0 and max(fractions) <= 1
    out = tmp_path_factory.mktemp("solved")
    job.solution.write(out, out, scene / "photos")
    return job, out


def number(name: str) -> int:
    return int(name.rpartition("view ")[2][:2])


@pytest.mark.slow
def test_solve_recovers_cameras(solved: tuple[SolveJob, Path]) -> None:
    _, out = solved
    truth = list(made.ring(VIEWS))
    found = read_colmap(out / "sparse").cameras
    assert len(found) == VIEWS
    assert {c.label for c in found} >= {"view 03.exr", "view 05.tif", "second round/view 01.jpg"}
    centres = np.array([c.pose.centre for c in found])
    exact = np.array([truth[number(c.label)].centre for c in found])
    scale, turn, shift = similarity(centres, exact)
    off = np.linalg.norm(scale * centres @ turn.T + shift - exact, axis=1)
    assert np.median(off) < 0.004 * made.DISTANCE
    angles = [
        np.degrees(angle(c.pose.rotation @ turn.T, truth[number(c.label)].rotation)) for c in found
    ]
    assert np.median(angles) < 0.15 and max(angles) < 0.5
    focal = [c.parameters[0] for c in found]
    assert np.median(focal) == pytest.approx(made.FOCAL, rel=0.015)


@pytest.mark.slow
def test_solve_reports_its_results(solved: tuple[SolveJob, Path], scene: Path) -> None:
    job, out = solved
    report = (out / "report.txt").read_text("utf-8")
    assert f"{VIEWS} of {VIEWS + 1} photos placed" in report
    assert "torn.jpg" in report and "notes.txt" not in report
    assert job.solution.error < 0.6
    (capture,) = out.glob("*.capture.toml")
    data = tomllib.loads(capture.read_text("utf-8"))
    assert (out / data["scan"]["images"]).resolve() == (scene / "photos").resolve()
    model = pycolmap.Reconstruction(str(out / "sparse"))
    colours = np.array([p.color for p in model.points3D.values()])
    # the stone is reddish: (0.9, 0.75, 0.6) of one grey
    assert (np.median(colours, axis=0)[:2] > np.median(colours, axis=0)[1:]).all()


@pytest.mark.slow
def test_lit_photos_are_localised(scene: Path, tmp_path: Path) -> None:
    views = list(made.ring(VIEWS))
    cameras = [
        exact(views[number(photo.name)], photo.name)
        for photo in find_photos(scene / "photos")
        if "view" in photo.name
    ]
    other = tmp_path / "other.jpg"  # an object that the scan does not show
    noise = np.random.default_rng(0).uniform(size=(120, 160, 3)).repeat(4, axis=0).repeat(4, axis=1)
    made.write_picture(other, noise)
    photos = [*sorted((scene / "lit").glob("*.jpg")), other]
    mesh = read_mesh(scene / "mesh.ply")
    job = LocaliseJob(cameras, scene / "photos", photos, mesh, threads=2)
    job.drain()
    result = job.result
    assert len(result.rejected) == 1 and "other.jpg" in result.rejected[0]
    read = read_reconstruction(result.write(tmp_path))
    assert [c.label for c in read.cameras] == ["lit_0.jpg", "lit_1.jpg"]
    for camera, found, (view, _) in zip(read.cameras, result.placed, lit_views(), strict=True):
        assert (camera.pose.rotation == found.camera.pose.rotation).all()
        truth = exact(view)
        off = np.linalg.norm(camera.project(mesh.vertices) - truth.project(mesh.vertices), axis=1)
        assert np.median(off) < 0.4
        assert np.degrees(angle(camera.pose.rotation, view.rotation)) < 0.2
        assert np.linalg.norm(camera.pose.centre - view.centre) < 0.003 * made.DISTANCE


def exact(view, label="x"):
    lens = (made.FOCAL, *made.PRINCIPAL)
    pose = Pose(view.rotation, view.translation)
    return Camera(label, made.WIDTH, made.HEIGHT, "SIMPLE_PINHOLE", lens, pose)


def angle(one, other):
    return np.arccos(np.clip((np.trace(one @ other.T) - 1) / 2, -1, 1))


def similarity(a, b):
    """Scale, rotation and translation that map points a to b (Umeyama 1991)."""
    ca, cb = a - a.mean(axis=0), b - b.mean(axis=0)
    u, s, vt = np.linalg.svd(cb.T @ ca)
    sign = np.diag([1, 1, np.sign(np.linalg.det(u @ vt))])
    turn = u @ sign @ vt
    scale = (s * np.diag(sign)).sum() / (ca**2).sum()
    return scale, turn, b.mean(axis=0) - scale * turn @ a.mean(axis=0)


def test_unsolvable_photos_are_reported(tmp_path: Path) -> None:
    with pytest.raises(InputError, match="no such folder"):
        SolveJob(tmp_path / "gone")
    with pytest.raises(InputError, match="no photos"):
        SolveJob(tmp_path)
    grey = np.full((120, 160, 3), 0.5)
    for i in range(3):
        made.write_picture(tmp_path / f"{i}.png", grey)
    job = SolveJob(tmp_path, threads=1)
    with pytest.raises(PatinaError, match="can be connected"):
        job.drain()
    (tmp_path / "2.png").write_bytes(b"\x89PNG\r\n\x1a\n torn")
    job = SolveJob(tmp_path, threads=1)
    with pytest.raises(PatinaError, match=r"found 2 usable photos.*2\.png"):
        job.drain()
    with pytest.raises(InputError, match="lens"):
        SolveJob(tmp_path, lens="FOV2")


def test_abandoned_job_stops_its_work(tmp_path: Path) -> None:
    import threading

    for i, view in enumerate(made.ring(3)):
        made.write_picture(tmp_path / f"{i}.jpg", made.photo(view, seed=i)[::2, ::2])
    shutil.copy(tmp_path / "0.jpg", tmp_path / "3.jpg")
    job = SolveJob(tmp_path, threads=1)
    assert job.step() and job.step()
    job.cancel()
    ends = time.monotonic() + 20
    while any(t.name == "patina-solve" for t in threading.enumerate()):
        assert time.monotonic() < ends
        time.sleep(0.05)
    assert not job.step()


def test_raw_files_with_a_developed_picture_are_skipped(tmp_path: Path) -> None:
    for name in ("a.JPG", "a.CR2", "b.cr2", ".hidden.jpg", "c.txt", "deep/d.tif", ".x/e.jpg"):
        (tmp_path / name).parent.mkdir(exist_ok=True)
        (tmp_path / name).write_bytes(b"")
    assert [p.name for p in find_photos(tmp_path)] == ["a.JPG", "b.cr2", "deep/d.tif"]


def test_full_disk_is_one_sentence(tmp_path):
    with pytest.raises(PatinaError, match="disk is full"), _full_disk_as_error(tmp_path / "a"):
        raise RuntimeError("[database_sqlite.cc:1362] SQLite error: database or disk is full")
    with pytest.raises(RuntimeError, match="another"), _full_disk_as_error(tmp_path / "a"):
        raise RuntimeError("another error")
