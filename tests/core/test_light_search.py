"""Lights found from photos of a ray-traced sphere, whose BRDF is not in the dictionary."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from patina.commands import find_lights as command
from patina.commands.command_line import main
from patina.core.basis import default_basis
from patina.core.capture import read_capture
from patina.core.errors import PatinaError
from patina.core.geometry import RayScene
from patina.core.inputs import capture_data
from patina.core.inputs.lights import find_lights
from patina.core.inputs.photos import LitPhotos
from patina.core.jobs.find_lights_job import FindLightsJob
from patina.core.light import MountedLight, NearLight
from patina.core.light_search import LampPhoto, UnknownLamp, draw_lamp_pixels, find_lamps
from patina.core.light_search.brdf_dictionary import BrdfDictionary
from patina.core.light_search.candidates import even_directions
from patina.core.light_search.cell_albedo import CellGrid, shared_albedo
from patina.core.light_search.jackknife import surface_blocks
from patina.core.light_search.log_cost import Measured
from patina.core.scan import Mesh
from patina.core.scan.readers.colmap import read_colmap
from tests import make_capture as made

POSITION, INTENSITY = np.array([1.9, 0.4, 2.6]), 20.0
OFFSET = np.array([0.4, -0.3, 0.0])


@pytest.fixture(scope="module")
def dictionary() -> BrdfDictionary:
    return BrdfDictionary.of(default_basis())


@pytest.fixture
def guessed(tmp_path: Path) -> Path:
    """A capture with six photos, whose lights are all guesses; ``true`` beside it is the truth."""
    path = made.make_capture(tmp_path)
    text = path.read_text("utf-8")
    (tmp_path / "true.capture.toml").write_text(text, "utf-8")
    lines = [
        "direction = [0.0, 0.0, 1.0]\nguess = true" if line.startswith("direction") else line
        for line in text.splitlines()
    ]
    path.write_text("\n".join(lines), "utf-8")
    return path


def degrees(one: np.ndarray, other: np.ndarray) -> float:
    return float(np.degrees(np.arccos(np.clip(one @ other, -1.0, 1.0))))


def truth(path: Path):
    return read_capture(path.parent / "true.capture.toml").lights


def test_command_finds_all_guessed_directions(guessed: Path) -> None:
    out = guessed.parent / "found.capture.toml"
    assert main(["find-lights", str(guessed), "--out", str(out)]) == 0
    found = read_capture(out).lights
    errors = [
        degrees(one.direction, true.direction)
        for one, true in zip(found, truth(guessed), strict=True)
    ]
    assert np.median(errors) < 2.0 and max(errors) < 5.0  # the goals for scans
    assert not any(one.guess for one in found)
    assert all(0 < one.standard_error < np.radians(20) for one in found)


def test_known_lights_stay_and_named_light_is_found(guessed: Path) -> None:
    capture = read_capture(guessed.parent / "true.capture.toml")
    first = capture.lights[0]
    wrong = replace(first, direction=-first.direction)
    job = FindLightsJob(replace(capture, lights=(wrong, *capture.lights[1:])), [first.name])
    job.drain()
    assert job.result.entries[1:] == capture.lights[1:]
    assert degrees(job.result.entries[0].direction, first.direction) < 5.0
    assert set(job.result.lamps) == {first.name}


def test_relative_strengths_are_found(guessed: Path) -> None:
    """Lamps of very different, unknown strengths: the ratios are found with the directions."""
    text = (guessed.parent / "true.capture.toml").read_text("utf-8")
    lines = [line for line in text.splitlines() if not line.startswith("irradiance")]
    guessed.write_text("\n".join(lines), "utf-8")
    for k, factor in ((2, 4.0), (4, 0.2)):
        rotation, translation = list(made.poses())[k - 1]
        light = list(made.light_directions())[k - 1]
        picture = made.photo(rotation, translation, light)
        made.write_exr(guessed.parent / f"lit_{k}.exr", (factor * picture).astype(np.float32))
    capture = read_capture(guessed)
    job = FindLightsJob(capture, [light.name for light in capture.lights])
    job.drain()
    found = np.array([light.relative_strength for light in job.result.entries])
    assert found[[0, 2, 4, 5]].tolist() == [1.0, 1.0, 1.0, 1.0]
    assert abs(np.log(found[1] / 4.0)) < np.log(1.6) and abs(np.log(found[3] / 0.2)) < np.log(1.6)
    lights = find_lights(
        replace(capture, lights=job.result.entries),
        capture_data.open_scan(capture),
        LitPhotos.open(capture),
    )
    second = lights.by_name[capture.lights[1].name]
    assert second.effective_irradiance == pytest.approx(np.full(3, found[1]))
    assert not second.known


def test_nothing_to_find_and_unknown_names_are_errors(guessed: Path) -> None:
    capture = read_capture(guessed.parent / "true.capture.toml")
    with pytest.raises(PatinaError, match="no light of the capture is marked as a guess"):
        FindLightsJob(capture)
    with pytest.raises(PatinaError, match="expected one of lamp1"):
        FindLightsJob(capture, ["sun"])
    with pytest.raises(PatinaError, match="is a folder"):
        command.run(_arguments(guessed, guessed.parent))


def _arguments(capture: Path, out: Path):
    import argparse

    return argparse.Namespace(capture=capture, light=[], out=out)


def test_black_photos_are_an_error(guessed: Path) -> None:
    for photo in guessed.parent.glob("lit_*.exr"):
        made.write_exr(photo, np.zeros((made.HEIGHT, made.WIDTH, 3), np.float32))
    job = FindLightsJob(read_capture(guessed))
    with pytest.raises(PatinaError, match="0 lit pixels"):
        job.drain()


def lit_sphere(tmp_path: Path, lamp_of) -> tuple[RayScene, tuple[LampPhoto, ...], float]:
    """(rays, photos lit by the lamps at lamp_of(rotation, translation), distance of the
    cameras)."""
    made.write_colmap(tmp_path / "sparse")
    cameras = read_colmap(tmp_path / "sparse").cameras
    vertices, faces = made.sphere_mesh()
    rays = RayScene.build(Mesh(np.asarray(vertices, np.float64), np.asarray(faces, np.int32)))
    rng, photos = np.random.default_rng(0), []
    for camera, (rotation, translation) in zip(cameras, made.poses(), strict=True):
        at = lamp_of(rotation, translation)
        towards = at / np.linalg.norm(at)
        picture = made.photo(rotation, translation, towards, lamp=(at, INTENSITY))
        material = np.zeros(picture.shape[:2], np.int16)
        photos.append(
            draw_lamp_pixels(rays, camera, picture.astype(np.float32), material, 1500, rng)
        )
    return rays, tuple(photos), made.DISTANCE


def searched(lamp: UnknownLamp, rays: RayScene, dictionary: BrdfDictionary):
    steps = find_lamps([lamp], 1, rays, dictionary)
    fractions = []
    while True:
        try:
            fractions.append(next(steps))
        except StopIteration as end:
            assert fractions == sorted(fractions) and 0 <= fractions[0] <= fractions[-1] <= 1
            return end.value.lamps[0]


def test_near_lamp_is_found(tmp_path: Path, dictionary: BrdfDictionary) -> None:
    rays, photos, _ = lit_sphere(tmp_path, lambda rotation, translation: POSITION)
    found = searched(UnknownLamp(NearLight("lamp", np.zeros(3)), photos), rays, dictionary)
    away = np.linalg.norm(POSITION - made.CENTRE)
    assert np.linalg.norm(found.light.position - POSITION) < 0.05 * away
    assert found.standard_error < 0.2 * away


def test_flash_offset_is_found(tmp_path: Path, dictionary: BrdfDictionary) -> None:
    rays, photos, distance = lit_sphere(tmp_path, lambda r, t: r.T @ (OFFSET - t))
    found = searched(UnknownLamp(MountedLight("flash", np.zeros(3)), photos), rays, dictionary)
    assert np.linalg.norm((found.light.offset - OFFSET)[:2]) < 0.02 * distance
    assert abs(found.light.offset[2]) < 0.1 * distance


def test_dictionary_holds_different_materials(dictionary: BrdfDictionary) -> None:
    """All are non-negative, have the same level, and range from matte to glossy."""
    assert (dictionary.table >= 0).all() and np.isfinite(dictionary.table).all()
    normal, view = np.array([[0.0, 0.0, 1.0]]), np.array([[0.0, 0.0, 1.0]])
    mirror = dictionary.evaluate(normal, view, np.array([[0.0, 0.0, 1.0]]))[0]
    side = dictionary.evaluate(normal, view, np.array([[0.8, 0.0, 0.6]]))[0]
    contrast = mirror / side
    assert contrast.min() < 3 and contrast.max() > 100


def test_dictionary_is_reciprocal(dictionary: BrdfDictionary) -> None:
    rng = np.random.default_rng(0)
    directions = rng.standard_normal((2, 50, 3))
    directions[..., 2] = np.abs(directions[..., 2])
    view, light = directions / np.linalg.norm(directions, axis=-1, keepdims=True)
    normal = np.broadcast_to([0.0, 0.0, 1.0], (50, 3))
    one = dictionary.evaluate(normal, view, light)
    np.testing.assert_allclose(one, dictionary.evaluate(normal, light, view), rtol=1e-4)


@settings(max_examples=30, deadline=None)
@given(gain=st.floats(1e-3, 1e3), unit=st.floats(1e-6, 1e6), seed=st.integers(0, 99))
def test_cost_does_not_depend_on_units(gain: float, unit: float, seed: int) -> None:
    """Neither the unit of the photos nor that of the prediction changes cost and gain."""
    rng = np.random.default_rng(seed)
    radiance = rng.uniform(0, 1, 200) ** 3
    predicted = radiance * np.exp(0.2 * rng.standard_normal(200))
    plain = Measured.of(radiance)
    expected = plain.cost(plain.gain(predicted) * predicted)
    scaled = Measured.of(unit * radiance)
    found = scaled.gain(gain * predicted) * gain * predicted
    assert scaled.cost(found) == pytest.approx(expected, rel=1e-6)


def test_level_ignores_shadow_and_highlight() -> None:
    """Most of a photo is black and a highlight holds much of the light: the level is that of the
    lit surface."""
    lit = np.full(1000, 0.2)
    radiance = np.concatenate([np.zeros(9000), lit, np.full(10, 20.0)])
    assert Measured.of(radiance).offset == pytest.approx(0.6 * 0.2)


def test_albedo_common_to_two_lamps_is_found() -> None:
    rng = np.random.default_rng(0)
    points = rng.uniform(0, 1, (4000, 3)) * [1, 1, 0]
    albedo = np.where(points[:, 0] > 0.5, 0.4, -0.4)
    ratios = [albedo + 0.1 * rng.standard_normal(4000) for _ in range(2)]
    found = shared_albedo(CellGrid.around(points), [points, points], ratios)
    assert found is not None
    assert np.corrcoef(np.log(found.at(points)), albedo)[0, 1] > 0.95


def test_residuals_of_one_lamp_are_no_albedo() -> None:
    rng = np.random.default_rng(0)
    points = rng.uniform(0, 1, (4000, 3)) * [1, 1, 0]
    wrong_light = [0.5 * (points[:, 0] - 0.5), 0.5 * (points[:, 1] - 0.5)]
    assert shared_albedo(CellGrid.around(points), [points, points], wrong_light) is None


@given(count=st.integers(20, 400))
def test_directions_cover_the_sphere(count: int) -> None:
    found = even_directions(count)
    np.testing.assert_allclose(np.linalg.norm(found, axis=1), 1.0)
    assert np.linalg.norm(found.mean(axis=0)) < 2 / count


def test_blocks_are_compact() -> None:
    points = np.random.default_rng(0).uniform(-1, 1, (5000, 3))
    block = surface_blocks(points)
    assert block.max() + 1 == 125
    size = max(np.ptp(points[block == b], axis=0).max() for b in range(125))
    assert size < 0.45
