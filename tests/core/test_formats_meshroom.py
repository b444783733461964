"""Round trips of Meshroom scenes of every version and lens."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from patina.core.errors import InputError
from patina.core.scan.formats import read_reconstruction
from tests import make_reconstructions as made
from tests.check_formats import CX, CY, K, P, check, check_points, seen
from tests.make_points_scene import (
    FOCAL,
    HEIGHT,
    WIDTH,
    Distort,
    Scene,
    Vector,
    brown,
    field_of_view,
    fisheye,
    make_scene,
)


@pytest.fixture(scope="module")
def scene() -> Scene:
    return make_scene()


SENSOR = {"sensorWidth": 36.0, "sensorHeight": 27.0}
LENS_IN_PIXELS = {"pxFocalLength": FOCAL, "pxInitialFocalLength": -1.0, "principalPoint": [CX, CY]}
OFFSET_FROM_CENTRE = {"principalPoint": [CX - WIDTH / 2, CY - HEIGHT / 2]}
LENS_IN_MILLIMETRES = {
    **SENSOR,
    **OFFSET_FROM_CENTRE,
    "focalLength": FOCAL / WIDTH * 36,
    "initialFocalLength": -1.0,
}


@pytest.mark.parametrize(
    ("intrinsic", "distort"),
    [
        ({"type": "pinhole"}, brown()),
        ({"type": "radial1", "distortionParams": K[:1]}, brown(K[:1])),
        ({"type": "radial3", "distortionParams": K[:3]}, brown(K[:3])),
        ({"type": "brown", "distortionParams": (*K[:3], *P)}, brown(K[:3], P)),
        ({"type": "fisheye4", "distortionParams": K}, fisheye(K)),
        ({"type": "fisheye1", "distortionParams": [0.9]}, field_of_view(0.9)),
        (
            {"type": "pinhole", "distortionType": "radialk3", "distortionParams": K[:3]},
            brown(K[:3]),
        ),
    ],
    ids=lambda value: value["type"] if isinstance(value, dict) else "",
)
@pytest.mark.parametrize("version", ["1.0.0", "1.2.0", "1.2.1", "1.2.4", "1.2.8"])
def test_meshroom_round_trip(
    tmp_path: Path, scene: Scene, intrinsic: dict[str, object], distort: Distort, version: str
) -> None:
    path = tmp_path / "cameras.sfm"
    fy = FOCAL
    if version >= "1.2.2":  # millimetres, relative to the image centre
        written = {**LENS_IN_MILLIMETRES, "pixelRatio": 1.02 if version >= "1.2.5" else 1 / 1.02}
        fy = FOCAL * 1.02
    elif version >= "1.2.0":
        fy = FOCAL * 1.03
        written = {
            **LENS_IN_PIXELS,
            "pxFocalLength": [FOCAL, fy],
            **(OFFSET_FROM_CENTRE if version >= "1.2.1" else {}),
        }
    else:
        written = LENS_IN_PIXELS
    made.write_meshroom(path, scene, {**written, **intrinsic}, version)
    found = read_reconstruction(path)
    check(found, seen(scene, distort, fy=fy), scene)
    check_points(found, scene)


@pytest.mark.parametrize(
    ("version", "written"),
    [
        ("1.2.0", {"pxFocalLength": [1000, 2000], "principalPoint": [2020, 1040]}),
        ("1.2.5", {"focalLength": 8.7976539589442808, "pixelRatio": 2}),
        ("1.2.8", {"focalLength": 8.7976539589442808, "pixelRatio": 2}),
        ("1.2.11", {"focalLength": 17.595307917888562, "pixelRatio": 2}),
        ("1.2.14", {"focalLength": 17.595307917888562, "pixelRatio": 2}),
    ],
)
def test_meshroom_versions_of_one_scene_agree(
    tmp_path: Path, scene: Scene, version: str, written: dict[str, object]
) -> None:
    """Values of AliceVision's compatibilityData/scene_v*.json, which its own tests read as fx 1000,
    fy 2000, offset (−26, 16) and a rotation by √3 rad about (−1, −1, −1)."""
    path = tmp_path / "scene.json"
    common = {"type": "pinhole", "width": 4092, "height": 2048, "sensorWidth": 36,
              "principalPoint": [-26, 16], "distortionParams": ""}  # fmt: skip
    made.write_meshroom(path, scene, {**common, **written}, version)
    content = json.loads(path.read_text())
    content["poses"] = content["poses"][:1]
    content["poses"][0]["pose"]["transform"]["rotation"] = [
        "0.22629564095020641", "-0.18300791965761709", "0.95671227870741093",
        "0.95671227870741093", "0.22629564095020641", "-0.18300791965761709",
        "-0.18300791965761709", "0.95671227870741093", "0.22629564095020641",
    ]  # fmt: skip
    path.write_text(json.dumps(content))
    (camera,) = read_reconstruction(path).cameras
    lens = camera.lens
    assert np.isclose(lens.focal_length_x, 1000) and np.isclose(lens.focal_length_y, 2000)
    assert (lens.principal_point_x, lens.principal_point_y) == (2020, 1040)
    rotation = Rotation.from_rotvec([-1, -1, -1]).as_matrix()
    assert np.allclose(camera.pose.rotation, rotation)


def test_meshroom_specific_distortion_models(tmp_path: Path, scene: Scene) -> None:
    path = tmp_path / "cameras.json"
    scale = 1 + sum(K[:3])
    lens = {
        **LENS_IN_MILLIMETRES,
        "type": "pinhole",
        "distortionType": "radialk3pt",
        "distortionParams": K[:3],
    }
    made.write_meshroom(path, scene, lens)
    check(
        read_reconstruction(path),
        seen(scene, brown(K[:3]), FOCAL / scale, FOCAL / scale),
        scene,
    )
    # equidistant: θ over half the view of the sensor's shorter side, times the circle's radius
    radius, half = 250.0, 0.5 * 27.0 / (FOCAL / WIDTH * 36)
    circle = {"fisheyeCircleCenterX": 0.0, "fisheyeCircleCenterY": 0.0}
    lens = {**LENS_IN_MILLIMETRES, **circle, "type": "equidistant", "fisheyeCircleRadius": radius}
    made.write_meshroom(path, scene, lens)
    check(read_reconstruction(path), seen(scene, fisheye(), radius / half, radius / half), scene)
    k = (-0.05, 0.02, 0.01)

    def equidistant_r3(x: float, y: float, z: float) -> Vector:
        u, v = fisheye()(x, y, z)
        return brown(k)(u / half, v / half, 1.0)

    scale = radius / (1 + sum(k))
    made.write_meshroom(path, scene, {**lens, "type": "equidistant_r3", "distortionParams": k})
    check(read_reconstruction(path), seen(scene, equidistant_r3, scale, scale), scene)


def test_unknown_pixel_ratio_convention_is_rejected(tmp_path: Path, scene: Scene) -> None:
    path = tmp_path / "cameras.sfm"
    made.write_meshroom(
        path, scene, {**LENS_IN_MILLIMETRES, "type": "pinhole", "pixelRatio": 1.0}, "1.2.10"
    )
    check(read_reconstruction(path), seen(scene, brown()), scene)
    made.write_meshroom(
        path, scene, {**LENS_IN_MILLIMETRES, "type": "pinhole", "pixelRatio": 2.0}, "1.2.10"
    )
    with pytest.raises(InputError, match=r"pixelRatio.*1\.2\.10"):
        read_reconstruction(path)
