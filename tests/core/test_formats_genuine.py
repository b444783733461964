"""Files written by the tools themselves: the cameras agree with the observations in the files.

The observations are parsed here, independently of the readers under test.
"""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np
import pytest

from patina.core.errors import InputError
from patina.core.scan.formats import read_reconstruction

Array = np.ndarray


def reprojection_errors(pixels: Array, observed: Array) -> Array:
    return np.linalg.norm(pixels - observed, axis=1)


@pytest.fixture
def cameras(shared: Path) -> Path:
    return shared / "data" / "cameras"


def test_bundler_reprojection_errors(cameras: Path) -> None:
    path = cameras / "bundler" / "kshi_Lightbender_bundle.out"
    found = read_reconstruction(path)
    assert len(found.cameras) == 5 and len(found.points) == 249
    lines = path.read_text().splitlines()[2 + 5 * 5 :]
    errors = []
    for place, views in zip(lines[::3], lines[2::3], strict=True):
        numbers = np.array(views.split(), float)
        point = np.array([place.split()], float)
        for camera, _, x, y in numbers[1:].reshape(-1, 4):
            known = found.cameras[int(camera)]
            # from the photo's centre, y up
            observed = np.array([[known.width / 2 + x, known.height / 2 - y]])
            errors.append(reprojection_errors(known.project(point), observed)[0])
    assert len(errors) > 500
    assert np.median(errors) < 1.0 and np.percentile(errors, 90) < 3.0


def test_nvm_reprojection_errors(cameras: Path) -> None:
    path = cameras / "nvm" / "sbcv_VisualSFM_example.nvm"
    found = read_reconstruction(path)
    assert len(found.cameras) == 11 and len(found.points) == 7817
    assert {(c.width, c.height) for c in found.cameras} == {(2832, 2128)}
    lines = path.read_text().splitlines()
    names = [Path(line.split()[0]).name for line in lines[3:14]]
    known = {camera.label: camera for camera in found.cameras}
    seen: dict[str, list[list[float]]] = {name: [] for name in names}
    for line in lines[16 : 16 + 7817]:
        values = [float(word) for word in line.split()]
        for i in range(int(values[6])):
            camera, _, x, y = values[7 + 4 * i : 11 + 4 * i]
            seen[names[int(camera)]].append([*values[:3], x, y])
    errors = []
    for name, rows in seen.items():
        table = np.array(rows)
        errors.append(reprojection_errors(known[name].project(table[:, :3]), table[:, 3:]))
    assert np.median(np.concatenate(errors)) < 0.6
    assert np.percentile(np.concatenate(errors), 90) < 1.5


def test_openmvg_reprojection_errors(cameras: Path) -> None:
    path = cameras / "openmvg" / "kapture_maupertuis_sfm_data.json"
    found = read_reconstruction(path)
    assert len(found.cameras) == 4 and len(found.points) == 365
    data = json.loads(path.read_text())
    names = {
        view["key"]: view["value"]["ptr_wrapper"]["data"]["filename"] for view in data["views"]
    }
    known = {camera.label: camera for camera in found.cameras}
    errors = []
    for entry in data["structure"]:
        point = np.array([entry["value"]["X"]])
        for seen in entry["value"]["observations"]:
            camera = known[names[seen["key"]]]
            errors.append(
                reprojection_errors(camera.project(point), np.array([seen["value"]["x"]]))[0]
            )
    assert len(errors) > 700 and np.median(errors) < 1.0


def test_opensfm_points_project_into_the_photos(cameras: Path) -> None:
    """The file holds no observations: its points project into the photos, and it has colours and a
    georeference."""
    found = read_reconstruction(cameras / "opensfm" / "kapture_berlin_reconstruction.json")
    assert [camera.label for camera in found.cameras] == ["01.jpg", "02.jpg", "03.jpg"]
    assert len(found.points) == 1702 and found.colours.std() > 20
    in_photo = []
    for camera in found.cameras:
        pixels = camera.project(found.points)
        with np.errstate(invalid="ignore"):
            in_photo.append(((pixels > 0) & (pixels < (camera.width, camera.height))).all(axis=1))
    # points are triangulated from at least two photos
    assert (np.sum(in_photo, axis=0) >= 2).mean() > 0.95
    place = found.georeference
    assert place is not None and abs(place.latitude - 52.519) < 1e-3  # Berlin
    # photos taken by a person on the ground are roughly level
    for camera in found.cameras:
        assert abs(camera.pose.rotation[2] @ place.up) < np.sin(np.radians(35))


def test_transforms_central_rays_intersect(cameras: Path) -> None:
    """All views look at one object: the rays through the image centres nearly intersect."""
    path = cameras / "transforms_json" / "lambkin108_TensoRF_mydata_transforms.json"
    found = read_reconstruction(path)
    assert len(found.cameras) == 110
    assert {camera.model for camera in found.cameras} == {"OPENCV"}
    centres = np.array([camera.pose.centre for camera in found.cameras])
    image_centre = np.array([[400.0, 400.0]])
    central_rays = np.array([camera.rays(image_centre)[0] for camera in found.cameras])
    projectors = np.eye(3) - central_rays[:, :, None] * central_rays[:, None, :]
    intersection = np.linalg.solve(projectors.sum(0), np.einsum("nij,nj->i", projectors, centres))
    ray_distances = np.linalg.norm(
        np.einsum("nij,nj->ni", projectors, intersection - centres), axis=1
    )
    distance = np.einsum("ni,ni->n", intersection - centres, central_rays)
    assert (distance > 0).all()  # in front of all of them
    assert np.median(ray_distances) < 0.1 * np.median(distance)


def test_meshroom_file_without_poses_is_rejected(cameras: Path) -> None:
    """The genuine .sfm file was written before the poses were computed; the error says so."""
    path = cameras / "meshroom" / "alicevision_small.sfm"
    with pytest.raises(InputError, match=r"30 photos and no pose.*sfm\.abc"):
        read_reconstruction(path)


def test_meshroom_lens_is_read(cameras: Path, tmp_path: Path) -> None:
    """The same file with one added pose: 43.456 mm on a 36 mm sensor, 6016 pixels wide."""
    data = json.loads((cameras / "meshroom" / "alicevision_small.sfm").read_text())
    rotation = ["1", "0", "0", "0", "1", "0", "0", "0", "1"]
    pose = {"transform": {"rotation": rotation, "center": ["0", "0", "0"]}, "locked": "0"}
    data["poses"] = [{"poseId": data["views"][0]["poseId"], "pose": pose}]
    path = tmp_path / "posed.sfm"
    path.write_text(json.dumps(data))
    found = read_reconstruction(path)
    assert found.notes == ("Photos without a pose or a lens that were left out: 29.",)
    camera = found.cameras[0]
    assert (camera.width, camera.height, camera.label) == (6016, 3200, "1119.exr")
    assert np.isclose(camera.lens.focal_length_x, 43.45584412271571 / 36 * 6016)
    assert (camera.lens.principal_point_x, camera.lens.principal_point_y) == (3008, 1600)
