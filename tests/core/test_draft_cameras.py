"""Cameras that a new capture lacks: solved from its photos, or localised in the scan."""

from __future__ import annotations

import shutil
from pathlib import Path

import numpy as np
import pytest

from patina.core.capture import read_capture
from patina.core.errors import InputError
from patina.core.inputs import capture_data
from patina.core.new_capture import (
    Draft,
    DraftJob,
    DraftPhoto,
    LocaliseDraftJob,
    SolveDraftJob,
    photo_folders,
)
from tests import make_photos_of_scene as made

VIEWS = 14
LIGHTS = ((0.5, -0.3, -0.8), (-0.6, -0.5, -0.6))  # towards the lamps, in the camera's frame


@pytest.fixture(scope="module")
def shoot(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """scan/: photos in even light; lit/: two photos from the viewpoint of one of them, two from new
    viewpoints, each pair under two lamps. No cameras."""
    folder = tmp_path_factory.mktemp("shoot")
    (folder / "scan").mkdir()
    (folder / "lit").mkdir()
    views = list(made.ring(VIEWS))
    for i, view in enumerate(views):
        made.write_picture(folder / "scan" / f"view_{i:02d}.jpg", made.photo(view, seed=i))
    for k, light in enumerate(LIGHTS):
        for name, view in ((f"view_{k:02d}", views[k]), (f"new_{k}", new_view(k))):
            picture = made.photo(view, view.rotation.T @ np.array(light), seed=50 + k)
            made.write_picture(folder / "lit" / f"{name}.jpg", picture)
    return folder


def new_view(k: int) -> made.View:
    (view,) = made.ring(1, heights=(0.55,), start=(0.13, 2.2)[k])
    return view


def finished(job) -> Draft:
    job.drain()
    assert job.draft is not None
    return job.draft


@pytest.mark.slow
def test_photos_alone_become_a_capture(shoot: Path) -> None:
    draft = finished(DraftJob([shoot]))
    assert draft.cameras is None and "solve" in (draft.missing or "")
    files = [photo.file for photo in draft.photos]
    assert photo_folders(files) == ((shoot / "scan", VIEWS), (shoot / "lit", 4))
    job = SolveDraftJob(draft, shoot / "scan")
    draft = finished(job)
    assert f"{VIEWS} of {VIEWS}" in job.summary
    assert draft.cameras == shoot / "scan solved" / "sparse" and draft.images == shoot / "scan"
    assert {photo.file.parent.name for photo in draft.photos} == {"lit"}
    assert "mesh" in (draft.missing or "")

    mesh = in_solved_frame(draft.cameras, shoot)
    draft = finished(DraftJob([mesh], draft))
    assert not draft.problems, draft.problems
    how = {photo.file.stem: photo.how for photo in draft.photos}
    assert how["view_00"] == how["view_01"] == "by name"
    assert how["new_0"] == how["new_1"] == "", how
    draft = finished(LocaliseDraftJob(draft, shoot / "localised.cameras.json"))
    assert draft.missing is None and not draft.problems, (draft.missing, draft.problems)
    how = {photo.file.stem: photo.how for photo in draft.photos}
    assert all(how[f"new_{k}"].startswith("localised, ±") for k in (0, 1)), how
    assert sum(" lamps for " in line for line in draft.found) == 1, draft.found

    out = shoot / "new.capture.toml"
    draft.write(out)
    capture = read_capture(out)
    scan = capture_data.open_scan(capture)
    for place, photo in enumerate(capture.photos):
        camera = capture_data.camera_of(capture, scan, place)
        stem = photo.file.stem
        true = new_view(int(stem[-1])) if "new" in stem else list(made.ring(VIEWS))[int(stem[-2:])]
        towards = true.rotation[2]
        back = camera.pose.rotation[2] @ solved_to_true(draft.cameras)[1].T
        assert np.degrees(np.arccos(min(back @ towards, 1.0))) < 0.5, stem
    # a folder that holds the file of localised cameras is recognised as a whole
    again = finished(DraftJob([shoot / "lit", draft.cameras, mesh, draft.extra]))
    assert again.extra == draft.extra and all(photo.camera for photo in again.photos)


def solved_to_true(model: Path):
    """(scale, rotation, translation) from the solved frame to the true one."""
    from patina.core.scan.readers.colmap import read_colmap
    from tests.core.test_solve_scene import similarity

    views = list(made.ring(VIEWS))
    found = read_colmap(model).cameras
    centres = np.array([camera.pose.centre for camera in found])
    return similarity(centres, np.array([views[int(c.label[5:7])].centre for c in found]))


def in_solved_frame(model: Path, folder: Path) -> Path:
    """The true mesh in the frame of a solved model, as a dense reconstruction would write it."""
    import trimesh

    scale, turn, shift = solved_to_true(model)
    made.write_mesh(folder / "true.ply")
    mesh = trimesh.load(folder / "true.ply", process=False)
    mesh.vertices = (mesh.vertices - shift) @ turn / scale
    (folder / "true.ply").unlink()
    mesh.export(folder / "model.ply")
    return folder / "model.ply"


def test_what_is_missing_for_localising_is_said(tmp_path: Path) -> None:
    photo = DraftPhoto(tmp_path / "a.jpg")
    with pytest.raises(InputError, match="of the scan"):
        LocaliseDraftJob(Draft(photos=(photo,)), tmp_path / "out.cameras.json")
    full = Draft(tmp_path / "c", tmp_path / "m", tmp_path, (DraftPhoto(tmp_path / "a", "c"),))
    with pytest.raises(InputError, match="every photo has a camera"):
        LocaliseDraftJob(full, tmp_path / "out.cameras.json")


def test_other_cameras_reset_the_matches(tmp_path: Path) -> None:
    """Cameras of another scan replace the first: its labels mean nothing in the new one."""
    from tests import make_capture

    first = make_capture.make_capture(tmp_path / "a")
    first.unlink()
    for k in range(1, 7):
        (tmp_path / "a" / f"lit_{k}.exr").rename(tmp_path / "a" / f"view_{k:02}.exr")
    draft = finished(DraftJob([tmp_path / "a"]))
    assert draft.missing is None
    shutil.copytree(tmp_path / "a" / "sparse", tmp_path / "other" / "sparse")
    photos = tuple(DraftPhoto(p.file, "gone.jpg", "by name") for p in draft.photos)
    stale = Draft(draft.cameras, draft.mesh, None, photos, draft.lamps, extra=tmp_path / "x")
    again = finished(DraftJob([tmp_path / "other" / "sparse"], stale))
    assert again.extra is None
    assert [p.camera for p in again.photos] == [f"view_{k:02}.jpg" for k in range(1, 7)]
