"""Mask files: a capture that names them describes the same scene, and a fit uses them."""

from __future__ import annotations

import shutil
import tomllib
import unicodedata
from dataclasses import replace
from pathlib import Path
from types import SimpleNamespace

import numpy as np
import OpenImageIO as oiio
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from patina.core.capture import read_capture
from patina.core.errors import InputError
from patina.core.geometry import RayScene, view_surface
from patina.core.inputs import capture_data
from patina.core.inputs.lights import find_lights
from patina.core.inputs.material_pixels import material_pixels
from patina.core.inputs.photos import LitPhotos
from patina.core.masks.capture_text import capture_with_masks
from patina.core.masks.shadow import from_grey, light_visibility
from patina.core.masks.write_masks import MasksJob, MasksSettings, _stems, check_final
from tests import make_capture as made


def pixels(path: Path) -> np.ndarray:
    return oiio.ImageBuf(str(path)).get_pixels(oiio.UINT8)[..., 0]


def two_balls(folder: Path) -> Path:
    """The ball and a smaller one in the scan that shadows it, under lamps of finite size."""
    path = made.make_capture(folder, photos=3, extra='[[material]]\nname = "red"')
    vertices, faces = made.sphere_mesh(3)
    light = next(made.light_directions(3))
    moon = 0.25 * (vertices - made.CENTRE) + made.CENTRE + 1.6 * light + [0.0, 0.0, 0.2]
    both = np.concatenate([vertices, moon])
    made.write_ply(folder / "mesh.ply", both, np.concatenate([faces, faces + len(vertices)]))
    text = path.read_text()
    path.write_text(text.replace("irradiance", "angle = 8.0\nirradiance", 1))
    return path


def write(path: Path, out: Path, wanted: MasksSettings):
    out.mkdir()
    job = MasksJob(read_capture(path), wanted, out, out)
    job.drain()
    assert job.result is not None
    return job.result


def test_shadow_masks_match_visibility_and_exclude_penumbra(tmp_path: Path) -> None:
    path = two_balls(tmp_path / "in")
    done = write(path, tmp_path / "out", MasksSettings(uncertainty=0.0))
    capture = read_capture(done.capture)
    scan = capture_data.open_scan(capture)
    capture_data.check_photos(capture, scan)
    rays = RayScene.build(scan.mesh)
    lights = find_lights(capture, scan, LitPhotos.open(capture))
    partial = 0
    for place in range(3):
        camera = capture_data.camera_of(capture, scan, place)
        view = view_surface(rays, camera)
        exact = light_visibility(
            rays, view, lights.of(capture, place), camera, 512, uncertainty=0.0
        )
        grey = pixels(capture.photos[place].masks["shadow"])
        assert grey.shape == (made.HEIGHT, made.WIDTH)
        assert (grey[~view.seen] == 0).all()
        visibility = from_grey(grey.ravel()[view.pixel])
        assert np.abs(visibility - exact).mean() < 0.01
        _, out = material_pixels(capture, scan, view, capture_data.photo_masks(capture, place))
        assert out[exact < 0.88].all()
        assert not out[exact > 0.999].any()
        partial += int(((exact > 0.1) & (exact < 0.9)).sum())
    assert partial > 100


def test_new_capture_equals_old_one_except_masks(tmp_path: Path) -> None:
    path = two_balls(tmp_path / "in")
    before = path.read_bytes()
    old = read_capture(path)
    new = read_capture(write(path, tmp_path / "out", MasksSettings()).capture)
    assert path.read_bytes() == before
    assert new.file.name == path.name and new.file.parent == tmp_path / "out"
    assert {p.name for p in (tmp_path / "out").iterdir()} == {"masks", path.name}
    for one, other in zip(old.photos, new.photos, strict=True):
        assert other.files[0].resolve() == one.files[0].resolve()
        assert replace(other, files=one.files, masks={}) == one
        assert set(other.masks) == {"shadow"}
    assert new.scan.mesh.resolve() == old.scan.mesh.resolve()
    assert new.scan.cameras.resolve() == old.scan.cameras.resolve()
    assert new.materials == old.materials and new.fit == old.fit
    for mine, its in zip(old.lights, new.lights, strict=True):
        assert np.array_equal(mine.direction, its.direction) and mine.angle == its.angle


def test_existing_artist_masks_are_kept(tmp_path: Path) -> None:
    path = two_balls(tmp_path / "in")
    mask = np.zeros((made.HEIGHT, made.WIDTH))
    mask[5:20, 30:90] = 255
    made.write_png(path.parent / "mine.png", mask)
    text = path.read_text()
    path.write_text(
        text.replace('light = "lamp1"', 'light = "lamp1"\nmasks = {shadow = "mine.png"}')
    )
    new = read_capture(write(path, tmp_path / "out", MasksSettings()).capture)
    assert (pixels(new.photos[0].masks["shadow"])[5:20, 30:90] == 255).all()
    assert (pixels(path.parent / "mine.png") == mask).all()


def test_proposed_material_masks_partition_the_object(tmp_path: Path) -> None:
    from tests.core.test_material_proposal import halves, painted

    paints = [((0.2, 0.04, 0.03), 0.3, 40), ((0.04, 0.06, 0.2), 0.3, 40)]
    path = made.make_capture(tmp_path / "in", photos=6, brdf=painted(paints, halves))
    done = write(path, tmp_path / "out", MasksSettings(shadows=False, materials=True))
    capture = read_capture(done.capture)
    assert [m.name for m in capture.materials] == ["material_1", "material_2"]
    tally = np.zeros((2, 2))
    for photo in capture.photos:
        assert set(photo.masks) == {"material_1", "material_2"}
        one, two = (pixels(photo.masks[name]) for name in ("material_1", "material_2"))
        lit = oiio.ImageBuf(str(photo.file)).get_pixels(oiio.FLOAT)
        red, blue = lit[..., 0] > 1.5 * lit[..., 2] + 1e-6, lit[..., 2] > 1.5 * lit[..., 0] + 1e-6
        assert not (one & two).any()
        tally += [[(a & (m > 0)).sum() for m in (one, two)] for a in (red, blue)]
    # also pixels that no photo shows well enough to measure
    assert max(np.trace(tally), np.trace(tally[::-1])) > 0.96 * tally.sum()


def test_single_material_needs_no_masks(tmp_path: Path) -> None:
    path = made.make_capture(tmp_path / "in", photos=4)
    capture = read_capture(
        write(path, tmp_path / "out", MasksSettings(shadows=False, materials=True)).capture
    )
    assert [m.name for m in capture.materials] == ["surface"]
    assert not any(photo.masks for photo in capture.photos)


def test_capture_files_are_not_overwritten(tmp_path: Path) -> None:
    path = two_balls(tmp_path)
    with pytest.raises(InputError, match="overwritten"):
        check_final(read_capture(path), tmp_path)
    check_final(read_capture(path), tmp_path / "other")
    (tmp_path / "out").mkdir()
    again = write(path, tmp_path / "out2", MasksSettings()).capture
    with pytest.raises(InputError, match="overwritten"):
        check_final(read_capture(again), again.parent)


def test_all_capture_paths_are_rewritten_for_new_folder(tmp_path: Path) -> None:
    path = two_balls(tmp_path / "in")
    for name in ("a.png", "b.png"):
        made.write_png(path.parent / name, np.full((made.HEIGHT, made.WIDTH), 255))
    text = path.read_text()
    text = text.replace(
        "irradiance = [3.0, 3.0, 3.0]",
        'white = {photo = "lit_1.exr", mask = "a.png", reflectance = 0.9}',
    )
    shutil.copy(path.parent / "lit_2.exr", path.parent / "longer.exr")
    text = text.replace('file = "lit_2.exr"', 'file = ["lit_2.exr", "longer.exr"]')
    text = text.replace(
        'light = "lamp2"', 'light = "lamp2"\nmasks = {red = "b.png"}\nexposure = [1, 2]'
    )
    text = text.replace('mesh = "mesh.ply"', 'mesh = "mesh.ply"\nimages = "."')
    path.write_text(text)
    old = read_capture(path)
    there = tmp_path / "a" / "b"
    there.mkdir(parents=True)
    (there / "x.capture.toml").write_text(capture_with_masks(old, there, None, None))
    new = read_capture(there / "x.capture.toml")
    assert new.scan.images is not None and new.scan.images.resolve() == path.parent.resolve()
    assert [f.resolve() for f in new.photos[1].files] == [f.resolve() for f in old.photos[1].files]
    assert new.photos[1].masks["red"].resolve() == path.parent / "b.png"
    assert new.lights[0].white is not None
    assert new.lights[0].white.mask.resolve() == path.parent / "a.png"


@pytest.fixture(scope="module")
def commented(tmp_path_factory: pytest.TempPathFactory) -> Path:
    path = made.make_capture(tmp_path_factory.mktemp("commented"), photos=2)
    path.write_text(f"# of a Tuesday\n{path.read_text()}# the end\n")
    return path


@given(st.dictionaries(st.text(min_size=1), st.text(), max_size=4), st.lists(st.text(), max_size=3))
@settings(max_examples=100, deadline=None)
def test_unusual_names_are_written_unchanged(commented: Path, masks, materials) -> None:
    """The standard TOML parser reads what was written; comments are kept."""
    old = read_capture(commented)
    text = capture_with_masks(old, commented.parent, ["a.png", "b.png"], materials, [masks])
    data = tomllib.loads(text)
    assert data["photo"][0]["masks"] == {**masks, "shadow": "a.png"}
    assert data["photo"][1]["masks"] == {"shadow": "b.png"}
    assert [entry["name"] for entry in data.get("material", [])] == materials
    assert "# of a Tuesday" in text and "# the end" in text


@pytest.mark.parametrize("names", [
    ("lit/x.exr", "b/x.exr", "lit/001_x.exr"),
    ("a.exr", "A.exr"),
    ("caf\u00e9.exr", "cafe\u0301.exr"),
])  # fmt: skip
def test_masks_of_each_photo_have_a_name_of_their_own(names):
    photos = [SimpleNamespace(file=Path(name)) for name in names]
    found = _stems(SimpleNamespace(photos=photos))
    assert len({unicodedata.normalize("NFC", stem).casefold() for stem in found}) == len(names)


def test_masks_of_distinct_photos_have_their_names():
    photos = [SimpleNamespace(file=Path(name)) for name in ("a/one.exr", "b/two.exr")]
    assert _stems(SimpleNamespace(photos=photos)) == ["one", "two"]
