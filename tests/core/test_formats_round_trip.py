"""A scene is written in each format and read back: its 1,000 points project to the same pixels."""

from __future__ import annotations

import math
from pathlib import Path

import numpy as np
import pytest

from patina.core.scan.formats import read_reconstruction
from tests import make_reconstructions as made
from tests.check_formats import CLOSE, CX, CY, K, P, check, check_points, seen
from tests.make_points_scene import (
    FOCAL,
    HEIGHT,
    WIDTH,
    Distort,
    Scene,
    Vector,
    brown,
    fisheye,
    make_scene,
    panorama,
)


@pytest.fixture(scope="module")
def scene() -> Scene:
    return make_scene()


@pytest.fixture(scope="module")
def photos(scene: Scene, tmp_path_factory: pytest.TempPathFactory) -> Path:
    return made.write_photos(tmp_path_factory.mktemp("scan") / "photos", scene)


@pytest.mark.parametrize("k", [(0.0, 0.0), K[:2]])
def test_bundler_round_trip(tmp_path: Path, scene: Scene, photos: Path, k: Vector) -> None:
    path = tmp_path / "bundle" / "bundle.out"
    path.parent.mkdir()
    expected = made.write_bundler(path, scene, *k)
    found = read_reconstruction(path, photos)
    check(found, expected, scene)
    check_points(found, scene)
    assert not found.notes
    # without photos, the image size is estimated from the features, and a note says so
    without_photos = read_reconstruction(path)
    assert any("estimated" in note and "images" in note for note in without_photos.notes)
    for camera in without_photos.cameras:
        assert 0.5 * WIDTH < camera.width <= 1.1 * WIDTH


@pytest.mark.parametrize("r", [0.0, 0.08, -0.08])
@pytest.mark.parametrize("colmap", [False, True])
def test_nvm_round_trip(tmp_path: Path, scene: Scene, photos: Path, r: float, colmap: bool) -> None:
    path = tmp_path / "model.nvm"
    expected = made.write_nvm(path, scene, r, colmap)
    found = read_reconstruction(path, photos)
    check(found, expected, scene)
    check_points(found, scene)
    assert any("COLMAP" in note for note in found.notes) == (colmap and r != 0)


def test_nvm_without_photos(tmp_path: Path, scene: Scene) -> None:
    """COLMAP counts pixels from the corner; the image centre is estimated from points and poses."""
    path = tmp_path / "model.nvm"
    made.write_nvm(path, scene, 0.08, colmap=True)
    found = read_reconstruction(path)
    assert {(c.width, c.height) for c in found.cameras} == {(WIDTH, HEIGHT)}
    assert any("estimated" in note for note in found.notes)


def test_nvm_with_a_fixed_calibration(tmp_path: Path, scene: Scene, photos: Path) -> None:
    path = tmp_path / "model.nvm"
    expected = made.write_nvm(path, scene, 0.05, fixed=True)
    check(read_reconstruction(path, photos), expected, scene)


def test_nvm_with_several_models(tmp_path: Path, scene: Scene, photos: Path) -> None:
    path = tmp_path / "two.nvm"
    expected = made.write_nvm(path, scene, 0.08)
    first = path.read_text().partition("\n\n\n0")[0]
    small = "\n\n1\nphotos/other.png 500 1 0 0 0 0 0 0 0 0\n\n1\n0 0 5 1 2 3 1 0 0 -3 -4\n"
    path.write_text(first.replace("NVM_V3 \n", "NVM_V3 \n" + small, 1) + "\n0\n")
    found = read_reconstruction(path, photos)
    check(found, expected, scene)
    assert any("2 models" in note for note in found.notes)
    assert [c.label for c in read_reconstruction(path, None, "1").cameras] == ["other.png"]
    check(read_reconstruction(path, photos, "2"), expected, scene)


@pytest.mark.parametrize("per_frame", [False, True])
@pytest.mark.parametrize("extension", [False, True])
@pytest.mark.parametrize(
    ("lens", "distort"),
    [
        ({}, brown()),
        ({"camera_model": "PINHOLE"}, brown()),
        ({"k1": K[0], "k2": K[1], "p1": P[0], "p2": P[1]}, brown(K[:2], P)),
        ({"camera_model": "OPENCV", **dict(zip(("k1", "k2", "k3", "k4"), K, strict=True))},
         brown(K)),
        ({"camera_model": "OPENCV", "k3": K[2], "p1": P[0], "p2": P[1]}, brown((0, 0, K[2]), P)),
        ({"camera_model": "OPENCV", "k1": K[0], "k4": K[3], "p1": P[0], "p2": P[1]},
         brown((K[0], 0, 0, K[3]), P)),
        ({"camera_model": "OPENCV_FISHEYE", **dict(zip(("k1", "k2", "k3", "k4"), K, strict=True))},
         fisheye(K)),
        ({"is_fisheye": True, "k1": K[0]}, fisheye(K[:1])),
    ],
)  # fmt: skip
def test_transforms_round_trip(
    tmp_path: Path, scene: Scene, lens: dict[str, object], distort: Distort, per_frame: bool,
    extension: bool,
) -> None:  # fmt: skip
    path = tmp_path / "transforms.json"
    lens_fields = {
        "fl_x": FOCAL,
        "fl_y": FOCAL + 9,
        "cx": CX,
        "cy": CY,
        "w": WIDTH,
        "h": HEIGHT,
        **lens,
    }
    made.write_transforms(path, scene, lens_fields, extension, per_frame)
    check(read_reconstruction(path), seen(scene, distort, fy=FOCAL + 9), scene)


def test_transforms_with_angle_of_view_and_image_size_from_photos(
    tmp_path: Path, scene: Scene
) -> None:
    made.write_photos(tmp_path / "photos", scene)
    path = tmp_path / "transforms.json"
    angle = 2 * math.atan(WIDTH / 2 / FOCAL)
    for extension in (True, False):
        made.write_transforms(path, scene, {"camera_angle_x": angle}, extension)
        check(read_reconstruction(path), seen(scene, brown(), cx=WIDTH / 2, cy=HEIGHT / 2), scene)


def test_nerfstudio_transforms_can_be_mapped_to_the_original_frame(
    tmp_path: Path, scene: Scene
) -> None:
    """applied_transform and applied_scale map the original frame to that of the file."""
    path = tmp_path / "transforms.json"
    applied, scale = [[0, 0, 1, 0.5], [1, 0, 0, -2.0], [0, 1, 0, 3.0]], 0.25
    lens_fields = {"fl_x": FOCAL, "w": WIDTH, "h": HEIGHT, "applied_transform": applied,
           "applied_scale": scale}  # fmt: skip
    made.write_transforms(path, scene, lens_fields)
    found = read_reconstruction(path)
    original = found.moved("original")
    points = np.array(scene.points)
    # p_json = scale · (A p_original)
    matrix = np.array(applied)
    original_points = (points / scale - matrix[:, 3]) @ matrix[:, :3]
    for camera, moved in zip(found.cameras, original.cameras, strict=True):
        assert np.abs(camera.project(points) - moved.project(original_points)).max() < 1e-6


@pytest.mark.parametrize(
    ("kind", "intrinsic", "distort"),
    [
        ("pinhole", {}, brown()),
        ("pinhole_radial_k1", {"disto_k1": K[:1]}, brown(K[:1])),
        ("pinhole_radial_k3", {"disto_k3": K[:3]}, brown(K[:3])),
        ("pinhole_brown_t2", {"disto_t2": (*K[:3], *P)}, brown(K[:3], P)),
        ("fisheye", {"fisheye": K}, fisheye(K)),
    ],
)
def test_openmvg_round_trip(
    tmp_path: Path, scene: Scene, kind: str, intrinsic: dict[str, object], distort: Distort
) -> None:
    path = tmp_path / "sfm_data.json"
    lens_fields = {"focal_length": FOCAL, "principal_point": [CX, CY], **intrinsic}
    made.write_openmvg(path, scene, kind, lens_fields)
    found = read_reconstruction(path)
    check(found, seen(scene, distort), scene)
    check_points(found, scene, colours=False)


LONGER_SIDE = max(WIDTH, HEIGHT)
ONE_FOCAL = {"focal": FOCAL / LONGER_SIDE}
TWO_FOCALS = {
    "focal_x": FOCAL / LONGER_SIDE, "focal_y": FOCAL / LONGER_SIDE + 0.01,
    "c_x": (CX - WIDTH / 2) / LONGER_SIDE, "c_y": (CY - HEIGHT / 2) / LONGER_SIDE,
}  # fmt: skip
COEFFICIENTS = dict(zip(("k1", "k2", "k3", "k4", "p1", "p2"), (*K, *P), strict=True))


def values_of(*names: str) -> dict[str, float]:
    return {name: COEFFICIENTS[name] for name in names}


@pytest.mark.parametrize(
    ("kind", "camera", "distort"),
    [
        ("perspective", {**ONE_FOCAL, **values_of("k1", "k2")}, brown(K[:2])),
        ("fisheye", {**ONE_FOCAL, **values_of("k1", "k2")}, fisheye(K[:2])),
        ("dual", {**ONE_FOCAL, **values_of("k1", "k2"), "transition": 1.0}, brown(K[:2])),
        ("dual", {**ONE_FOCAL, **values_of("k1", "k2"), "transition": 0.0}, fisheye(K[:2])),
        ("brown", {**TWO_FOCALS, **values_of("k1", "k2", "k3", "p1", "p2")}, brown(K[:3], P)),
        ("radial", {**TWO_FOCALS, **values_of("k1", "k2")}, brown(K[:2])),
        ("simple_radial", {**TWO_FOCALS, **values_of("k1")}, brown(K[:1])),
        ("fisheye_opencv", {**TWO_FOCALS, **values_of("k1", "k2", "k3", "k4")}, fisheye(K)),
        ("fisheye62", {**TWO_FOCALS, **COEFFICIENTS}, fisheye(K, P)),
        ("fisheye62", {**TWO_FOCALS, **values_of("k1", "k2", "k3", "k4"), "k5": 0.004,
                       "k6": -0.002}, fisheye((*K, 0.004, -0.002))),
    ],
)  # fmt: skip
def test_opensfm_round_trip(
    tmp_path: Path, scene: Scene, kind: str, camera: dict[str, object], distort: Distort
) -> None:
    path = tmp_path / "reconstruction.json"
    made.write_opensfm(path, scene, {"projection_type": kind, **camera})
    found = read_reconstruction(path)
    expected = seen(scene, distort, fy=FOCAL + 0.01 * LONGER_SIDE)
    if "focal" in camera:
        expected = seen(scene, distort, cx=WIDTH / 2, cy=HEIGHT / 2)
    check(found, expected, scene)
    check_points(found, scene)
    georeference = found.georeference
    assert georeference is not None
    assert (georeference.latitude, georeference.longitude, georeference.altitude) == (
        -33.5,
        151.25,
        12.0,
    )
    assert np.array_equal(
        np.stack([georeference.east, georeference.north, georeference.up]), np.eye(3)
    )


def test_panoramas_round_trip(tmp_path: Path, scene: Scene) -> None:
    """Equirectangular images are twice as wide as high, in each format that supports them."""
    image_size = {"width": WIDTH, "height": WIDTH // 2}
    made.write_opensfm(tmp_path / "a.json", scene, {"projection_type": "spherical", **image_size})
    made.write_openmvg(tmp_path / "b.json", scene, "spherical", {"value0": image_size})
    text = (tmp_path / "b.json").read_text().replace(f'"height": {HEIGHT}', '"height": 320')
    (tmp_path / "b.json").write_text(text)
    lens_fields = {
        "camera_model": "EQUIRECTANGULAR",
        "w": WIDTH,
        "h": WIDTH // 2,
        "fl_x": WIDTH / 2,
    }
    made.write_transforms(tmp_path / "c.json", scene, lens_fields)
    sphere = {"type": "equirectangular", "sensorWidth": 36.0, "focalLength": 36 / (2 * math.pi)}
    made.write_meshroom(tmp_path / "d.sfm", scene, {**sphere, "width": "640", "height": "320"})
    expected = seen(scene, panorama, WIDTH, WIDTH, WIDTH / 2, WIDTH / 4)
    for name in ("a.json", "b.json", "c.json", "d.sfm"):
        found = read_reconstruction(tmp_path / name)
        for camera in found.cameras:
            assert camera.panoramic
            expected_pixels = np.array(expected[camera.label])
            assert np.abs(camera.project(np.array(scene.points)) - expected_pixels).max() < CLOSE


REALITYSCAN_LENSES = [
    ((0.0, 0.0, 0.0, 0.0, 0.0, 0.0), brown()),
    ((*K[:3], 0.0, 0.0, 0.0), brown(K[:3])),
    ((*K[:3], 0.0, P[1], P[0]), brown(K[:3], P)),
    ((*K, 0.0, 0.0), brown(K)),
    ((*K, P[1], P[0]), brown(K, P)),
]
PRINCIPAL_POINT_OFFSET = (CX - WIDTH / 2) / LONGER_SIDE, (CY - HEIGHT / 2) / LONGER_SIDE


@pytest.mark.parametrize(("distortion", "distort"), REALITYSCAN_LENSES)
@pytest.mark.parametrize("newer", [False, True])
def test_realityscan_csv_round_trip(
    tmp_path: Path, scene: Scene, photos: Path, distortion: Vector, distort: Distort, newer: bool
) -> None:
    path = tmp_path / "cameras.csv"
    made.write_realityscan_csv(path, scene, distortion, PRINCIPAL_POINT_OFFSET, newer)
    check(read_reconstruction(path, photos), seen(scene, distort), scene)


@pytest.mark.parametrize(
    ("model", "which"),
    [("perspective", 0), ("division", 0), ("brown3", 1), ("brown3t2", 2), ("brown4", 3),
     ("brown4t2", 4)],
)  # fmt: skip
@pytest.mark.parametrize("elements", [True, False])
def test_realityscan_xmp_round_trip(
    tmp_path: Path, scene: Scene, photos: Path, model: str, which: int, elements: bool
) -> None:
    distortion, distort = REALITYSCAN_LENSES[which]
    made.write_realityscan_xmp(tmp_path, scene, model, distortion, PRINCIPAL_POINT_OFFSET, elements)
    check(read_reconstruction(tmp_path, photos), seen(scene, distort), scene)
    xmp = read_reconstruction(tmp_path / "IMG_0003.xmp", photos)
    assert [c.label for c in xmp.cameras] == ["IMG_0003"] and xmp.cameras[0].photo == "IMG_0003.png"


def test_realityscan_csv_agrees_with_another_export_of_the_same_camera(
    tmp_path: Path, scene: Scene
) -> None:
    """A camera that a forum post gives in both exports (forums.unrealengine.com, topic 710449; the
    last matrix element is cut off there)."""
    photos = made.write_photos(tmp_path / "photos", scene)
    path = tmp_path / "cameras.csv"
    path.write_text(
        "#name,x,y,alt,heading,pitch,roll,f\n"
        "IMG_0000.png,1,2,3,163.736597399311,83.4154313461628,174.386496244756,30\n"
    )
    rotation = read_reconstruction(path, photos).cameras[0].pose.rotation
    exported = [
        [0.982594073038806, 0.185426733553445, -0.0112166890261935],
        [-0.032113633044729, 0.11008102707942, -0.993403685341366],
        [-0.18296885582437, 0.976472781986697],
    ]
    for found, expected in zip(rotation, exported, strict=True):
        assert np.allclose(found[: len(expected)], expected, atol=1e-6)
