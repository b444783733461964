"""Invalid cameras, unsupported content and skipped entries: the message names each."""

from __future__ import annotations

import json
import re
from pathlib import Path

import numpy as np
import pytest

from patina.core.errors import InputError
from patina.core.scan.formats import read_reconstruction
from patina.core.scan.reconstruction import Reconstruction
from tests import make_reconstructions as made
from tests.damaged_formats import (
    BROWN_T2,
    JSONS,
    MILLIMETRES,
    NAMES,
    PIXELS,
    damaged,
    read,
    refused,
    write_all,
)
from tests.make_points_scene import WIDTH, make_scene


@pytest.fixture(scope="module")
def valid_files(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A folder with one valid file of each format, and the photos."""
    return write_all(tmp_path_factory.mktemp("whole"))


@pytest.mark.parametrize("name", NAMES[:-1])
def test_two_photos_with_the_same_name_are_rejected(
    valid_files: Path, tmp_path: Path, name: str
) -> None:
    path = tmp_path / name
    text = (valid_files / name).read_text()
    if name == "bundle.out":
        list_text = (valid_files / "list.txt").read_text().replace("IMG_0003", "IMG_0004")
        (tmp_path / "list.txt").write_text(list_text)
    if name == "reconstruction.json":  # JSON keys are unique
        return
    path.write_text(text.replace("IMG_0003", "IMG_0004"))
    refused(path, "two images are named 'IMG_0004.png'", images=valid_files / "photos")


@pytest.mark.parametrize("name", NAMES)
@pytest.mark.parametrize("focal", ["0", "-700"])
def test_nonpositive_focal_length_is_rejected(
    valid_files: Path, tmp_path: Path, name: str, focal: str
) -> None:
    valid_text = (valid_files / name).read_text()
    text = re.sub(
        r'(7\.0{10}e\+02(?= 1\.0)|\b700(?= 0\.)|(?<=focalLength": ")39\.4|(?<=fl_x": )700\.0|'
        r'(?<=focal_length": )700\.0|(?<=focal_x": )1\.1|39\.375)',
        focal, valid_text, count=1,
    )  # fmt: skip
    assert text != valid_text
    refused(
        damaged(valid_files, tmp_path, name, text.encode()),
        "focal length",
        images=valid_files / "photos",
    )


def mirrored(content: object) -> object:
    """The content with the first row of every rotation matrix negated (quaternions unchanged)."""
    if isinstance(content, dict):
        return {key: mirrored(value) for key, value in content.items()}
    if isinstance(content, list):
        if len(content) == 9 and all(isinstance(v, str) for v in content):
            return [f"-{v}".replace("--", "") if i % 3 == 0 else v for i, v in enumerate(content)]
        if len(content) in (3, 4) and all(isinstance(v, list) for v in content):
            return [[-float(v) for v in content[0]], *content[1:]]
        return [mirrored(value) for value in content]
    return content


@pytest.mark.parametrize("name", JSONS[:3])
def test_mirroring_pose_is_rejected(valid_files: Path, tmp_path: Path, name: str) -> None:
    content = mirrored(json.loads((valid_files / name).read_text()))
    path = tmp_path / name
    path.write_text(json.dumps(content))
    message = refused(path)
    assert "mirrors" in message or "determinant" in message


def test_unsupported_lens_models_are_rejected(valid_files: Path, tmp_path: Path) -> None:
    scene = make_scene(3)
    for lens in ("3deanamorphic4", "3declassicld", "3deradial4", "something"):
        made.write_meshroom(tmp_path / "a.sfm", scene, {**MILLIMETRES, "type": lens})
        refused(tmp_path / "a.sfm", lens, "not supported", "type")
    made.write_transforms(tmp_path / "t.json", scene, {**PIXELS, "camera_model": "FISHEYE624"})
    refused(tmp_path / "t.json", "FISHEYE624", "camera_model")
    made.write_openmvg(tmp_path / "o.json", scene, "thin_prism_fisheye", BROWN_T2)
    refused(tmp_path / "o.json", "thin_prism_fisheye")
    for camera in (
        {"projection_type": "dual", "focal": 1.0, "transition": 0.5},
        {"projection_type": "fisheye624", "focal_x": 1.0, "focal_y": 1.0},
        {"projection_type": "fisheye62", "focal_x": 1.0, "focal_y": 1.0, "k6": 0.1, "p1": 0.1},
    ):
        made.write_opensfm(tmp_path / "s.json", scene, camera)
        refused(tmp_path / "s.json", camera["projection_type"], "projection_type")
    for model in ("division", "rationalP2D1"):
        made.write_realityscan_xmp(tmp_path, scene, model, (0.1,) + (0.0,) * 5, (0.0, 0.0))
        refused(tmp_path, model, "xcr:DistortionModel", images=valid_files / "photos")


def test_realityscan_without_photos_requests_the_images_folder(
    valid_files: Path, tmp_path: Path
) -> None:
    for name in ("cameras.csv", "IMG_0003.xmp"):
        path = damaged(valid_files, tmp_path, name, (valid_files / name).read_bytes())
        refused(path, "set [scan] images to the folder of the photos")
    empty = tmp_path / "empty"
    empty.mkdir()
    refused(tmp_path / "cameras.csv", "IMG_0000.png", images=empty)
    refused(tmp_path / "cameras.csv", "no such folder", images=tmp_path / "nowhere")


def test_photos_are_not_searched_outside_the_folder(valid_files: Path, tmp_path: Path) -> None:
    """Of a path that leaves the file's folder, only the file name is used."""
    scan_folder = tmp_path / "inside"
    scan_folder.mkdir()
    outside_folder = made.write_photos(tmp_path / "outside", make_scene(1))
    row = "1,2,3,10,20,30,30"
    (scan_folder / "link").symlink_to(outside_folder)
    for name in (
        outside_folder / "IMG_0000.png", "../outside/IMG_0000.png", "link/IMG_0000.png",
        "..\\outside\\IMG_0000.png", "a/../../outside/IMG_0000.png",
    ):  # fmt: skip
        path = scan_folder / "cameras.csv"
        path.write_text(f"#name,x,y,alt,heading,pitch,roll,f\n{name},{row}\n")
        refused(path, "not found")
        found = read(path, outside_folder)  # the images folder given by the user
        assert isinstance(found, Reconstruction)
        assert found.cameras[0].label == "IMG_0000.png" and found.cameras[0].width == WIDTH


def test_entries_without_a_pose_are_skipped_and_reported(valid_files: Path, tmp_path: Path) -> None:
    content = json.loads((valid_files / "cameras.sfm").read_text())
    content["poses"] = content["poses"][:5]
    content["structure"][0]["X"] = ["nan", "0", "0"]
    path = tmp_path / "cameras.sfm"
    path.write_text(json.dumps(content))
    found = read_reconstruction(path)
    assert len(found.cameras) == 5 and len(found.points) == 11
    assert any(
        note.startswith("Photos without a pose") and note.endswith(": 3.") for note in found.notes
    )
    assert any(
        note.startswith("Sparse points without") and note.endswith(": 1.") for note in found.notes
    )
    # Bundler writes zeros for a photo without a pose
    lines = (valid_files / "bundle.out").read_text().splitlines()
    lines[2:7] = ["0 0 0"] * 5
    data = "\n".join(lines).encode()
    found = read_reconstruction(damaged(valid_files, tmp_path, "bundle.out", data))
    assert len(found.cameras) == 7
    assert any(
        note.startswith("Photos without a pose") and note.endswith(": 1.") for note in found.notes
    )
    (tmp_path / "list.txt").write_text("only_one.png\n")
    refused(tmp_path / "bundle.out", "list.txt", "lists 1 photos", "8 cameras")


def test_cameras_of_a_rig(valid_files: Path, tmp_path: Path) -> None:
    """A rig camera's pose is the rig's pose combined with the camera's pose in the rig."""
    content = json.loads((valid_files / "cameras.sfm").read_text())
    rotation = ["0", "1", "0", "-1", "0", "0", "0", "0", "1"]  # column-major: (x, y) → (−y, x)
    pose_in_rig = {"rotation": rotation, "center": ["0.5", "0", "0"]}
    content["rigs"] = [{"rigId": "77", "subPoses": [
        {"status": "constant", "pose": {"rotation": list("100010001"), "center": list("000")}},
        {"status": "estimated", "pose": pose_in_rig}]}]  # fmt: skip
    for view, index in zip(content["views"][:2], ("0", "1"), strict=True):
        view |= {"rigId": "77", "subPoseId": index, "isPoseIndependant": "false", "poseId": "1000"}
    path = tmp_path / "rig.sfm"
    path.write_text(json.dumps(content))
    first, second = read_reconstruction(path).cameras[:2]
    in_rig = np.array([[0.3, 0.2, 2.0]])
    point = (in_rig - first.pose.translation) @ first.pose.rotation
    x, y, z = in_rig[0] - (0.5, 0, 0)
    expected = np.array([[-y, x, z]])
    assert np.allclose(point @ second.pose.rotation.T + second.pose.translation, expected)
    content["views"][1]["subPoseId"] = "9"
    path.write_text(json.dumps(content))
    refused(path, "subPoseId", "the rig has 2 cameras")


def test_openmvg_references_to_shared_objects(valid_files: Path, tmp_path: Path) -> None:
    """cereal writes a shared object once and refers to it by id afterwards; type names too."""
    content = json.loads((valid_files / "sfm_data.json").read_text())
    second = json.loads(json.dumps(content["intrinsics"][0]))
    second["key"] = 1
    second["value"] = {"polymorphic_id": 1, "ptr_wrapper": {"id": 9}}
    content["intrinsics"].append(second)
    content["views"][2]["value"]["ptr_wrapper"]["data"]["id_intrinsic"] = 1
    path = tmp_path / "sfm_data.json"
    path.write_text(json.dumps(content))
    cameras = read_reconstruction(path).cameras
    assert len(cameras) == 8 and cameras[2].parameters == cameras[1].parameters
    second["value"]["ptr_wrapper"]["id"] = 12345
    path.write_text(json.dumps(content))
    refused(path, "12345")


def test_folder_names_distinguish_photos_with_the_same_name(
    valid_files: Path, tmp_path: Path
) -> None:
    content = json.loads((valid_files / "transforms.json").read_text())
    for i, frame in enumerate(content["frames"]):
        frame["file_path"] = f"C:\\scan\\day{i % 2}\\IMG_{i // 2}.png"
    path = tmp_path / "transforms.json"
    path.write_text(json.dumps(content))
    labels = [camera.label for camera in read_reconstruction(path).cameras]
    assert labels == sorted(f"day{i % 2}/IMG_{i // 2}.png" for i in range(8))


@pytest.mark.parametrize("name", NAMES)
def test_chunk_is_rejected_for_formats_without_chunks(valid_files: Path, name: str) -> None:
    with pytest.raises(InputError, match=r"scan\.chunk"):
        read_reconstruction(valid_files / name, valid_files / "photos", "a chunk")
