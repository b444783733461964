"""The embedded demo capture is small, complete and consistent with itself."""

from __future__ import annotations

import json
import struct
import tomllib
from pathlib import Path

import numpy as np
import pycolmap
import pytest

ROOT = Path(__file__).resolve().parents[2]
FOLDER = ROOT / "assets" / "demo"


@pytest.fixture(scope="module")
def capture() -> dict:
    return tomllib.loads((FOLDER / "demo.capture.toml").read_text(encoding="utf-8"))


@pytest.fixture(scope="module")
def model(capture: dict) -> pycolmap.Reconstruction:
    return pycolmap.Reconstruction(str(FOLDER / capture["scan"]["cameras"]))


@pytest.fixture(scope="module")
def points(capture: dict) -> np.ndarray:
    return read_points(FOLDER / capture["scan"]["mesh"])


def read_points(path: Path) -> np.ndarray:
    data = path.read_bytes()
    header, _, body = data.partition(b"end_header\n")
    count = int(header.split(b"element vertex ")[1].split()[0])
    return np.frombuffer(body, "<f4", 3 * count).reshape(-1, 3).astype(float)


def read_photo(path: Path) -> np.ndarray:
    import OpenImageIO as oiio

    return np.array(oiio.ImageBuf(str(path)).get_pixels(oiio.FLOAT), dtype=float)


def read_mask(path: Path) -> np.ndarray:
    """The first channel of an 8-bit mask."""
    import OpenImageIO as oiio

    return oiio.ImageBuf(str(path)).get_pixels(oiio.UINT8)[..., 0]


def image_of(model: pycolmap.Reconstruction, name: str) -> pycolmap.Image:
    image = model.find_image_with_name(name)
    assert image is not None, name
    return image


def project(model: pycolmap.Reconstruction, name: str, points: np.ndarray) -> np.ndarray:
    image = image_of(model, name)
    in_camera = image.cam_from_world() * points
    assert (in_camera[:, 2] > 0).all()
    return np.asarray(model.camera(image.camera_id).img_from_cam(in_camera))


def test_demo_folder_is_small() -> None:
    assert sum(path.stat().st_size for path in FOLDER.rglob("*") if path.is_file()) < 2.5e6


def test_folder_holds_exactly_the_referenced_files(capture: dict) -> None:
    referenced = {"README.md", "truth.json", "demo.capture.toml", capture["scan"]["mesh"]}
    for photo in capture["photo"]:
        referenced |= {photo["file"], *photo["masks"].values()}
    present = {path.relative_to(FOLDER).as_posix() for path in FOLDER.rglob("*") if path.is_file()}
    sparse = {name for name in present if name.startswith(capture["scan"]["cameras"] + "/")}
    assert referenced == present - sparse
    assert {"sparse/cameras.bin", "sparse/images.bin", "sparse/points3D.bin"} <= sparse


def test_lights_and_materials_are_complete(capture: dict) -> None:
    lamps = {light["name"]: light for light in capture["light"]}
    assert len(lamps) == 4 and len(capture["photo"]) == 8
    for light in lamps.values():
        assert np.linalg.norm(light["direction"]) == pytest.approx(1, abs=1e-5)
        assert np.allclose(light["irradiance"], np.pi, atol=1e-6)
    materials = {material["name"] for material in capture["material"]}
    for photo in capture["photo"]:
        assert photo["light"] in lamps
        assert set(photo["masks"]) == materials


def test_photos_masks_and_cameras_have_the_same_size(
    capture: dict, model: pycolmap.Reconstruction
) -> None:
    for photo in capture["photo"]:
        camera = model.camera(image_of(model, photo["camera"]).camera_id)
        pixels = read_photo(FOLDER / photo["file"])
        assert pixels.shape == (camera.height, camera.width, 3)
        assert np.isfinite(pixels).all()
        for mask in photo["masks"].values():
            header = (FOLDER / mask).read_bytes()[:26]
            assert header[1:4] == b"PNG"
            assert struct.unpack(">IIBB", header[16:26]) == (camera.width, camera.height, 8, 0)


def test_masks_are_disjoint_and_cover_lit_surface(capture: dict) -> None:
    for photo in capture["photo"]:
        bright = read_photo(FOLDER / photo["file"]).max(-1) > 0.02
        masks = {name: read_mask(FOLDER / file) for name, file in photo["masks"].items()}
        assert all(set(np.unique(mask)) == {0, 255} for mask in masks.values())
        glaze, clay = masks["glaze"] > 0, masks["clay"] > 0
        assert not (glaze & clay).any()
        assert (glaze & bright).mean() > 0.02, photo["file"]
        assert (clay & bright).sum() > 200, photo["file"]


def test_colmap_model_is_complete(model: pycolmap.Reconstruction) -> None:
    assert model.num_reg_images() == 24
    assert model.num_points3D() > 500
    assert model.compute_mean_reprojection_error() < 0.6
    (camera,) = model.cameras.values()
    assert camera.model.name == "PINHOLE"
    assert camera.principal_point_x != camera.width / 2


def test_object_is_inside_every_photo(model: pycolmap.Reconstruction, points: np.ndarray) -> None:
    for image in model.images.values():
        camera = model.camera(image.camera_id)
        pixels = project(model, image.name, points)
        assert (pixels >= 0).all() and (pixels <= [camera.width, camera.height]).all(), image.name
        assert np.ptp(pixels, axis=0).max() > 0.7 * camera.width


def test_masks_align_with_the_projected_mesh(
    capture: dict, model: pycolmap.Reconstruction, points: np.ndarray
) -> None:
    """Photos are not flipped or shifted: masks (eroded by a pixel) end where the mesh does."""
    for photo in capture["photo"]:
        masks = [read_mask(FOLDER / file) > 0 for file in photo["masks"].values()]
        rows, columns = np.nonzero(np.logical_or(*masks))
        pixels = project(model, photo["camera"], points)
        mask_bounds = np.array([columns.min(), rows.min(), -columns.max() - 1, -rows.max() - 1])
        mesh_bounds = np.concatenate([pixels.min(0), -pixels.max(0)])
        assert (mask_bounds - mesh_bounds > 0).all() and (mask_bounds - mesh_bounds < 3.5).all(), (
            photo["file"]
        )


def test_truth_file_matches_the_capture(capture: dict) -> None:
    truth = json.loads((FOLDER / "truth.json").read_text(encoding="utf-8"))
    assert "checks only" in truth["notice"]
    assert set(truth["materials"]) == {material["name"] for material in capture["material"]}
    for light in capture["light"]:
        assert np.allclose(truth["lights"][light["name"]], light["direction"], atol=1e-6)
