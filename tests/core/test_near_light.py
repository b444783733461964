"""Lamps near the object and flashes on the camera: physics, and ground truth from a sphere."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from patina.core.basis import default_basis
from patina.core.capture import read_capture
from patina.core.concurrency.steps import drained
from patina.core.errors import InputError
from patina.core.geometry import RayScene
from patina.core.inputs import capture_data
from patina.core.inputs.lights import find_lights, refined
from patina.core.inputs.photos import LitPhotos
from patina.core.light import DistantLight, MountedLight, NearLight
from patina.core.scan import Camera, Pose
from tests import make_capture as made
from tests.sampled import sampled

OFFSET = np.array([0.5, -0.7, 0.2])  # right, down, forward of the lens
INTENSITY = 20.0


def camera(seed: int = 0) -> Camera:
    rng = np.random.default_rng(seed)
    rotation = np.linalg.qr(rng.normal(size=(3, 3)))[0]
    rotation *= np.sign(np.linalg.det(rotation))
    pose = Pose(rotation, rng.normal(size=3))
    return Camera("c", 100, 80, "SIMPLE_PINHOLE", (90.0, 50.0, 40.0), pose)


def written(folder: Path, key: str, values: list, lamp_of, extra: str = "") -> Path:
    """The sphere of make_capture under a near lamp; lamp_of(rotation, translation) → position."""
    path = made.make_capture(folder)
    text = path.read_text()
    head, *_ = text.partition("[[light]]")
    lines = ["[[light]]", 'name = "lamp"', f"{key} = {values}", extra]
    for i, (rotation, translation) in enumerate(made.poses(6), start=1):
        lamp = (lamp_of(rotation, translation), INTENSITY)
        made.write_exr(folder / f"lit_{i}.exr", made.photo(rotation, translation, None, lamp=lamp))
        lines += ["[[photo]]", f'file = "lit_{i}.exr"', f'camera = "view_{i:02d}.jpg"']
        lines += ['light = "lamp"']
    path.write_text(head + "\n".join(lines) + "\n")
    return path


def flash(rotation, translation):
    """Position of a flash at OFFSET from the lens."""
    return rotation.T @ (OFFSET - translation)


@pytest.fixture(scope="module")
def flash_photos(tmp_path_factory: pytest.TempPathFactory) -> Path:
    intensity = f"intensity = {[INTENSITY] * 3}"
    return written(tmp_path_factory.mktemp("flash"), "mounted", OFFSET.tolist(), flash, intensity)


@given(st.floats(0.2, 50), st.floats(1.5, 4))
def test_irradiance_follows_inverse_square_law(distance: float, factor: float) -> None:
    lamp = NearLight("l", np.zeros(3), np.array([3.0, 2.0, 1.0]))
    points = np.array([[0, 0, distance], [0, 0, factor * distance]])
    found = lamp.incidence(points, camera())
    assert np.allclose(found.irradiance[0] / found.irradiance[1], factor**2)
    assert np.allclose(found.irradiance[0] * distance**2, [3, 2, 1])
    assert np.allclose(found.towards, [[0, 0, -1], [0, 0, -1]])


def test_far_lamp_equals_distant_light() -> None:
    direction = np.array([0.48, -0.6, 0.64])
    far = 1e5
    near = NearLight("l", far * direction, np.full(3, 2.0 * far**2))
    distant = DistantLight("l", direction, np.full(3, 2.0))
    points = np.random.default_rng(1).normal(size=(50, 3))
    a, b = near.incidence(points, camera()), distant.incidence(points, camera())
    assert np.allclose(a.towards, b.towards, atol=1e-4)
    assert np.allclose(a.irradiance, b.irradiance, rtol=1e-3)


@given(st.integers(0, 50))
def test_flash_moves_with_its_camera(seed: int) -> None:
    """In the camera's frame it always stands at its offset, and its beam points forward."""
    one = camera(seed)
    light = MountedLight("f", OFFSET, np.ones(3), beam=np.radians(30))
    at = light.position(one)
    assert np.allclose(one.pose.rotation @ at + one.pose.translation, OFFSET)
    forward = one.pose.rotation[2]
    aside = one.pose.rotation[0]
    tilted = np.cos(np.radians(30)) * forward + np.sin(np.radians(30)) * aside
    found = light.incidence(np.stack([at + 2 * forward, at + 2 * tilted]), one)
    assert found.irradiance[1, 0] == pytest.approx(0.5 * found.irradiance[0, 0])


def test_samples_under_flash_give_true_reflectance(flash_photos: Path) -> None:
    table, _ = sampled(flash_photos)
    truth = made.blinn(*(np.asarray(v, float) for v in (table.normal, table.light, table.view)))
    assert len(table) > 5000
    error = np.abs(table.rho / truth - 1)
    assert np.percentile(error, 90) < 0.03  # the mesh has facets, the sphere does not


def test_flash_at_wrong_position_gives_wrong_reflectance(
    flash_photos: Path, tmp_path: Path
) -> None:
    """The same photos, with the flash assumed at the lens: refinement must correct the error."""
    table, _ = sampled(flash_photos)
    right = np.abs(table.rho / made.blinn(
        *(np.asarray(v, float) for v in (table.normal, table.light, table.view))) - 1)  # fmt: skip
    text = flash_photos.read_text().replace(str(OFFSET.tolist()), "[0, 0, 0]")
    wrong_file = flash_photos.with_name("wrong.capture.toml")
    wrong_file.write_text(text)
    wrong, _ = sampled(wrong_file)
    off = np.abs(wrong.rho / made.blinn(
        *(np.asarray(v, float) for v in (wrong.normal, wrong.light, wrong.view))) - 1)  # fmt: skip
    assert np.median(off) > 10 * np.median(right)


def refined_lights(path: Path):
    capture = read_capture(path)
    scan = capture_data.open_scan(capture)
    photos = LitPhotos.open(capture)
    lights = find_lights(capture, scan, photos)
    rays = RayScene.build(scan.mesh)
    return drained(refined(lights, capture, scan, photos, rays, default_basis()))


def test_flash_position_is_recovered_from_photos(flash_photos: Path) -> None:
    """Unknown offset (started at the lens) and unknown intensity."""
    text = flash_photos.read_text().replace(str(OFFSET.tolist()), "[0, 0, 0]")
    text = text.replace(f"intensity = {[INTENSITY] * 3}", "refine = true")
    path = flash_photos.with_name("unknown.capture.toml")
    path.write_text(text)
    found = refined_lights(path)
    light = found.by_name["lamp"]
    assert isinstance(light, MountedLight)
    assert np.abs(light.offset - OFFSET)[:2].max() < 0.08  # of a camera 3.6 away: 1.3 degrees
    # along the view direction the photos carry little information
    assert np.abs(light.offset - OFFSET)[2] < 0.4
    before, after = found.unexplained
    assert after < 0.5 * before
    errors = [error for _, error in found.moved["lamp"].values()]
    assert np.isfinite(errors).all() and errors[0] < 0.15


def angular_error(offset: np.ndarray) -> float:
    """Degrees between the true and the estimated flash position, as seen from the object.

    Moving outwards and backwards together changes little, so the photos hardly determine it.
    """
    ball = np.array([0, 0, made.DISTANCE])
    a, b = (x - ball for x in (offset, OFFSET))
    return float(np.degrees(np.arccos(a @ b / np.linalg.norm(a) / np.linalg.norm(b))))


def test_true_flash_with_known_intensity_stays_in_place(flash_photos: Path) -> None:
    """Started at the true position with the true intensity, refinement stays there."""
    path = flash_photos.with_name("known.capture.toml")
    path.write_text(flash_photos.read_text().replace("mounted", "refine = true\nmounted"))
    assert angular_error(refined_lights(path).by_name["lamp"].offset) < 1.0


def test_light_refinement_with_two_materials(tmp_path: Path) -> None:
    """Half of the sphere is another material: one material for both halves would displace the
    light.
    """
    path = written(tmp_path, "mounted", [0, 0, 0], flash, "refine = true")
    vertices, faces = made.sphere_mesh()
    right = vertices[faces].mean(axis=1)[:, 0] > made.CENTRE[0]
    made.write_ply(tmp_path / "mesh.ply", vertices, faces, face_attribute=right.astype(int))

    def two(normal, light, view):
        gloss = made.blinn(normal, light, view)
        return np.where((normal[:, :1] > 0), gloss, 0.5 * np.ones(3))

    for i, (rotation, translation) in enumerate(made.poses(6), start=1):
        lamp = (flash(rotation, translation), INTENSITY)
        lit = made.photo(rotation, translation, None, lamp=lamp, brdf=two)
        made.write_exr(tmp_path / f"lit_{i}.exr", lit)
    materials = "".join(f'[[material]]\nname = "{name}"\nfaces = "part"\n' for name in "ab")
    path.write_text(path.read_text() + materials)
    assert angular_error(refined_lights(path).by_name["lamp"].offset) < 1.5


def test_missing_lit_pixels_for_light_refinement_are_reported(flash_photos: Path) -> None:
    text = flash_photos.read_text().replace(f"intensity = {[INTENSITY] * 3}", "refine = true")
    text = text.replace(str(OFFSET.tolist()), "[0, 0, 0]\nbeam = 5")
    path = flash_photos.with_name("narrow.capture.toml")
    path.write_text(text)
    assert refined_lights(path).by_name["lamp"] is not None  # a narrow beam works as a start too
    for i in range(1, 7):
        made.write_exr(flash_photos.with_name(f"black_{i}.exr"), np.zeros((90, 120, 3)))
        text = text.replace(f'"lit_{i}.exr"', f'"black_{i}.exr"')
    path.write_text(text)
    with pytest.raises(InputError, match=r"light 1\.refine.*0 pixels"):
        refined_lights(path)


def test_near_lamp_is_recovered_from_photos(tmp_path: Path) -> None:
    lamp = made.CENTRE + np.array([0.5, -0.6, 2.6])
    start = (lamp + np.array([0.5, 0.4, -0.3])).round(6).tolist()
    path = written(tmp_path, "position", start, lambda r, t: lamp, "refine = true")
    found = refined_lights(path).by_name["lamp"]
    assert isinstance(found, NearLight)
    towards = [x - made.CENTRE for x in (found.position, lamp)]
    cosine = towards[0] @ towards[1] / np.linalg.norm(towards[0]) / np.linalg.norm(towards[1])
    assert np.degrees(np.arccos(cosine)) < 1.5
    assert np.linalg.norm(towards[0]) == pytest.approx(np.linalg.norm(towards[1]), rel=0.15)


def test_distant_light_directions_are_refined(tmp_path: Path) -> None:
    """Six distant lights, each 3° off: refinement from the photos corrects them."""
    path = made.make_capture(tmp_path)
    rng = np.random.default_rng(5)
    text, truth = path.read_text(), list(made.light_directions(6))
    for direction in truth:
        aside = np.cross(direction, rng.normal(size=3))
        off = direction + np.tan(np.radians(3)) * aside / np.linalg.norm(aside)
        written_as = ", ".join(f"{x:.12g}" for x in direction)
        moved = ", ".join(f"{x:.12g}" for x in off / np.linalg.norm(off))
        text = text.replace(f"direction = [{written_as}]", f"direction = [{moved}]\nrefine = true")
    path.write_text(text)
    found = refined_lights(path).by_name
    angles = [
        np.degrees(np.arccos(np.clip(found[f"lamp{i + 1}"].direction @ d, -1, 1)))
        for i, d in enumerate(truth)
    ]
    assert np.median(angles) < 0.5
    assert max(angles) < 1.5


def test_flash_bracket_is_merged_to_one_photo(flash_photos: Path, tmp_path: Path) -> None:
    """Three exposures with clipping merge to the radiance of one photo."""
    capture = read_capture(flash_photos)
    whole = LitPhotos.open(capture).read(0).radiance
    files = []
    for exposure in (0.25, 1.0, 4.0):
        file = tmp_path / f"e{exposure}.exr"
        made.write_exr(file, np.minimum(whole * exposure, 1.0))
        files.append(file)
    photo = replace(
        capture.photos[0], files=tuple(files), exposures=(0.25, 1.0, 4.0), saturation=1.0
    )
    merged = LitPhotos.open(replace(capture, photos=(photo,))).read(0)
    inside = merged.usable & (whole.min(axis=2) > 0.01) & (whole.max(axis=2) < 3.9)
    assert inside.sum() > 500
    assert np.abs(merged.radiance[inside] / whole[inside] - 1).max() < 0.01
