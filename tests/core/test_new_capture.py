"""Files of a new capture: recognised, matched to cameras, grouped by lamp."""

from __future__ import annotations

import shutil
from datetime import datetime, timedelta
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from patina.core.capture import read_capture
from patina.core.errors import InputError
from patina.core.new_capture import (
    Draft,
    DraftJob,
    DraftLamp,
    DraftPhoto,
    LampKind,
    group_lamps,
    match_names,
    propose_lamps,
)
from patina.core.new_capture.draft import lamp_text
from patina.core.new_capture.recognise import sort_paths
from patina.core.scan import Camera
from patina.core.scan.camera import Pose
from tests import make_capture as made

START = datetime(2024, 5, 1, 12)
DEMO = Path(__file__).parents[2] / "assets" / "demo" / "demo.capture.toml"


def camera(label: str) -> Camera:
    return Camera(label, 4, 3, "PINHOLE", (5.0, 5.0, 2.0, 1.5), Pose(np.eye(3), np.zeros(3)))


def drafted(*paths: Path, before: Draft | None = None) -> Draft:
    job = DraftJob(paths, before)
    job.drain()
    assert job.draft is not None
    return job.draft


@pytest.fixture
def loose(tmp_path: Path) -> Path:
    """Cameras, mesh and six photos with names that match no camera, and no capture file. The
    photos are in another order than the cameras."""
    path = made.make_capture(tmp_path)
    path.unlink()
    for k in range(1, 7):
        (tmp_path / f"lit_{k}.exr").rename(tmp_path / f"shot_{'dafecb'[k - 1]}.exr")
    return tmp_path


def test_files_are_sorted_by_content(loose: Path) -> None:
    (loose / "notes.doc").write_text("nothing")
    (loose / ".hidden.exr").write_text("nothing")
    found = sort_paths([loose])
    assert [p.name for p in found.cameras] == ["sparse"]
    assert [p.name for p in found.meshes] == ["mesh.ply"]
    assert len(found.photos) == 6
    with pytest.raises(InputError, match="no such file"):
        sort_paths([loose / "gone"])


def test_file_of_a_model_stands_for_its_folder(loose: Path) -> None:
    assert sort_paths([loose / "sparse" / "images.bin"]).cameras == (loose / "sparse",)


def test_named_photos_become_a_capture(loose: Path) -> None:
    for k in range(1, 7):
        (loose / f"shot_{'dafecb'[k - 1]}.exr").rename(loose / f"view_{k:02}.exr")
    draft = drafted(loose)
    assert draft.missing is None and not draft.problems
    assert [photo.camera for photo in draft.photos] == [f"view_{k:02}.jpg" for k in range(1, 7)]
    out = loose / "new.capture.toml"
    draft.write(out)
    capture = read_capture(out)
    assert len(capture.photos) == 6 and all(light.guess for light in capture.lights)


def test_unreadable_mesh_is_a_problem_and_keeps_the_rest(loose: Path) -> None:
    first = drafted(loose / "sparse", *loose.glob("*.exr"))
    assert (first.missing or "").startswith("Add the mesh of the scan")
    (loose / "mesh.ply").write_bytes(b"ply\n")
    second = drafted(loose / "mesh.ply", before=first)
    assert "mesh.ply" in second.problems[0]
    assert second.cameras == first.cameras and len(second.photos) == 6


def test_mesh_of_another_scan_is_a_problem(loose: Path) -> None:
    vertices, faces = made.sphere_mesh()
    made.write_ply(loose / "mesh.ply", np.asarray(vertices) + np.array([500.0, 0, 0]), faces)
    draft = drafted(loose)
    assert any("mesh" in problem for problem in draft.problems), draft


def test_numbers_match_when_all_are_unique() -> None:
    cameras = [camera(f"IMG_{k:04}.JPG") for k in (7, 8, 9)]
    photos = [Path(f"lit{k}.exr") for k in (9, 7)]
    assert match_names.by_number(photos, cameras) == {
        photos[0]: "IMG_0009.JPG", photos[1]: "IMG_0007.JPG",
    }  # fmt: skip
    assert match_names.by_number([*photos, Path("lit12.exr")], cameras) == {}
    assert match_names.by_number([Path("a_7.exr"), Path("b_7.exr")], cameras) == {}
    assert match_names.by_number([Path("lit.exr")], cameras) == {}


def test_times_match_in_order() -> None:
    photos = {Path(f"{k}.jpg"): START + timedelta(minutes=k) for k in (3, 1, 2)}
    scan = {f"v{k}": START + timedelta(days=1, minutes=k) for k in (2, 3, 1)}
    assert match_names.by_time(photos, scan) == {Path(f"{k}.jpg"): f"v{k}" for k in (1, 2, 3)}
    assert match_names.by_time(photos, {**scan, "v4": None}) == {}
    assert match_names.by_time({}, {}) == {}


def test_lamps_by_folder_and_by_name() -> None:
    group = group_lamps.by_folder_or_name
    assert group([Path("a/1.exr"), Path("b/1.exr"), Path("a/2.exr")]) == [0, 1, 0]
    assert group([Path("lamp1_a.exr"), Path("lamp2_a.exr"), Path("lamp1_b.exr")]) == [0, 1, 0]
    assert group([Path("007-L3.exr"), Path("008-L4.exr")]) == [0, 1]
    assert group([Path("bill1.exr"), Path("bill2.exr")]) is None


def test_lamps_by_pauses() -> None:
    seconds = (0, 5, 11, 400, 406, 900)
    photos = [Path(f"{s}.jpg") for s in seconds]
    times = {p: START + timedelta(seconds=s) for p, s in zip(photos, seconds, strict=True)}
    assert group_lamps.by_time(photos, times) == [0, 0, 0, 1, 1, 2]
    assert group_lamps.by_time(photos, {**times, photos[0]: None}) is None
    even = {p: START + timedelta(seconds=30 * i) for i, p in enumerate(photos)}
    assert group_lamps.by_time(photos, even) is None


@given(st.lists(st.sampled_from([0, 1, 2]), min_size=1, max_size=12), st.integers(0, 1000))
def test_lamps_by_direction(lamps: list[int], seed: int) -> None:
    """Directions within 1° of three lamps are grouped as the lamps are."""
    axes = np.eye(3)
    noise = np.random.default_rng(seed).uniform(-0.01, 0.01, (len(lamps), 3))
    directions = [axes[k] + e for k, e in zip(lamps, noise, strict=True)]
    directions = [d / np.linalg.norm(d) for d in directions]
    first_seen = list(dict.fromkeys(lamps))
    assert group_lamps.by_direction(directions) == [first_seen.index(k) for k in lamps]


@pytest.mark.parametrize("kind", list(LampKind))
@pytest.mark.parametrize("stated", [False, True])
def test_only_stated_values_are_no_guess(kind: LampKind, stated: bool) -> None:
    text = lamp_text(DraftLamp("lamp", kind, (0.0, 0.6, 0.8), stated)).location_line
    assert ("guess = true" in text) == (not stated and kind is not LampKind.SUN)


def test_photos_added_later_keep_the_lamps_of_others(loose: Path) -> None:
    """Lamps that the user edited stay; a photo that shows nothing gets a lamp of its own."""
    shots = sorted(loose.glob("*.exr"))
    for k, shot in enumerate(shots, start=1):
        shot.rename(loose / f"view_{k:02}.exr")
    made.write_exr(loose / "view_02.exr", np.zeros((made.HEIGHT, made.WIDTH, 3), np.float32))
    named = [loose / f"view_{k:02}.exr" for k in range(1, 7)]
    first = drafted(loose / "sparse", loose / "mesh.ply", *named[:3])
    assert len({photo.lamp for photo in first.photos}) == 3
    edited = Draft(
        **{
            **vars(first),
            "lamps": (DraftLamp("mine", LampKind.FLASH), *first.lamps[1:]),
            "photos": tuple(DraftPhoto(p.file, p.camera, p.how) for p in first.photos),
        }
    )
    second = drafted(*named[3:], before=edited)
    assert [photo.lamp for photo in second.photos[:3]] == [0, 0, 0]
    assert second.lamps[0] == edited.lamps[0]
    assert min(photo.lamp for photo in second.photos[3:]) == len(edited.lamps)
    assert len(second.lamps) > len(edited.lamps)


def test_empty_folder_says_what_is_missing(tmp_path: Path) -> None:
    draft = drafted(tmp_path)
    assert not draft.found and draft.missing is not None and "cameras" in draft.missing


def test_incomplete_draft_says_what_is_missing(tmp_path: Path) -> None:
    full = Draft(
        Path("sparse"), Path("mesh.ply"), None, (DraftPhoto(Path("a.exr"), "a"),), (DraftLamp("l"),)
    )
    assert full.missing is None
    for change, words in (
        ({"cameras": None}, "cameras"), ({"mesh": None}, "mesh"), ({"photos": ()}, "photos"),
        ({"photos": (DraftPhoto(Path("b.exr")),)}, "b.exr"),
    ):  # fmt: skip
        draft = Draft(**{**vars(full), **change})
        assert draft.missing is not None and words in draft.missing
        with pytest.raises(InputError, match="not complete"):
            draft.write(tmp_path / "x.capture.toml")


def test_exif_flash_needs_less_agreement_of_the_shading() -> None:
    """A flash that fired may stand beside the camera: where most light comes from elsewhere, it
    is none on the camera."""
    near, wide, elsewhere = (float(np.cos(np.radians(d))) for d in (10, 40, 80))
    assert propose_lamps.is_flash([near] * 9 + [elsewhere], 10, fired=False)
    assert not propose_lamps.is_flash([wide] * 10, 10, fired=False)
    assert propose_lamps.is_flash([wide] * 6 + [elsewhere] * 4, 10, fired=True)
    assert not propose_lamps.is_flash([elsewhere] * 8 + [near] * 2, 10, fired=True)


@pytest.mark.slow
@pytest.mark.parametrize("name", ["yellow_box", "card_blue"])
def test_hand_held_flash_is_recognised(name: str, shared: Path) -> None:
    """Telephone photos of a flat sample: the flash is next to the lens, and moves with it."""
    folder = shared / "data" / "real" / "flash_plane" / name
    photos = sorted(folder.glob("0?.png"))
    draft = drafted(folder / "colmap", folder / "plane.obj", *photos)
    assert [lamp.kind for lamp in draft.lamps] == [LampKind.FLASH]
    assert {photo.lamp for photo in draft.photos} == {0}
    assert "the light comes from the camera" in draft.found[-1]
    assert not draft.lamps[0].stated  # so its place is found from the photos


def test_lamp_near_one_camera_is_no_flash(tmp_path: Path) -> None:
    """The cameras go around the object, and the lamp stays where it is."""
    path = made.make_capture(tmp_path / "in")
    rotation, translation = next(iter(made.poses(6)))
    towards = -np.asarray(rotation).T @ np.asarray(translation) - made.CENTRE
    light = towards / np.linalg.norm(towards)
    for k, (turn, shift) in enumerate(made.poses(6), 1):
        made.write_exr(path.parent / f"lit_{k}.exr", made.photo(turn, shift, light))
    path.unlink()
    draft = drafted(path.parent)
    assert [lamp.kind for lamp in draft.lamps] != [LampKind.FLASH]


EXTENT = 2.0 * np.sqrt(3)  # diagonal of the box of the sphere


def photographed(folder: Path, lamps: list[np.ndarray], distance: float | None) -> Draft:
    """The draft of six photos of a sphere, two for each lamp. lamps: (3,) unit directions;
    distance: from the centre of the sphere, None for distant lamps."""
    path = made.make_capture(folder)
    path.unlink()
    for k, (turn, shift) in enumerate(made.poses(6)):
        towards = lamps[k // 2]
        lamp = None if distance is None else (made.CENTRE + distance * towards, 1.0)
        picture = made.photo(turn, shift, towards, lamp=lamp)
        (folder / f"lit_{k + 1}.exr").unlink()
        made.write_exr(folder / f"view_{k + 1:02}.exr", picture.astype(np.float32))
    return drafted(folder)


@pytest.mark.parametrize("far", [None, 1.0])
def test_near_lamps_are_told_from_distant_ones(far: float | None, tmp_path: Path) -> None:
    views = [-rotation[2] for rotation, _ in made.poses()]
    lamps = [views[k] + views[k + 1] + np.array([0, 0, 1.0]) for k in (0, 2, 4)]
    lamps = [towards / np.linalg.norm(towards) for towards in lamps]
    draft = photographed(tmp_path, lamps, None if far is None else far * EXTENT)
    kind = LampKind.UNKNOWN if far is None else LampKind.NEAR
    assert [lamp.kind for lamp in draft.lamps] == 3 * [kind]
    assert [photo.lamp for photo in draft.photos] == [0, 0, 1, 1, 2, 2]
    assert ("near the object" in draft.found[-1]) == (far is not None)
    assert draft.missing is None and not any(lamp.stated for lamp in draft.lamps)
    for lamp, towards in zip(draft.lamps, lamps, strict=True):
        away = np.array(lamp.values) - (0 if far is None else np.array(made.CENTRE))
        assert away @ towards > np.cos(np.radians(5)) * np.linalg.norm(away)


@pytest.mark.slow
def test_near_lamps_of_the_demo(tmp_path: Path) -> None:
    """Photos that Cycles rendered, of a lamp that is 2.8 extents of the object away."""
    shutil.copytree(DEMO.parent / "sparse", tmp_path / "sparse")
    shutil.copy(DEMO.parent / "mesh.ply", tmp_path)
    true = {}
    for letter, shot in zip("hcfaegdb", read_capture(DEMO).photos, strict=True):
        shutil.copy(shot.file, tmp_path / f"shot_{letter}.exr")
        true[f"shot_{letter}.exr"] = shot.light
    draft = drafted(tmp_path)
    found = [photo for photo in draft.photos if photo.camera is not None]
    pairs = {(true[photo.file.name], photo.lamp) for photo in found}
    assert len(found) >= 7
    assert {lamp.kind for lamp in draft.lamps} == {LampKind.NEAR}
    assert len(pairs) == len(draft.lamps) == len(set(true.values()))
