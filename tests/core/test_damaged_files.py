"""Damaged files: a one-line error names the file; never a hang, a crash or a wrong value."""

from __future__ import annotations

import shutil
import struct
from collections.abc import Callable
from pathlib import Path

import numpy as np
import OpenImageIO as oiio
import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from patina.core.brdf import nbrdf
from patina.core.capture import read_capture
from patina.core.errors import InputError, PatinaError
from patina.core.jobs import FitJob
from patina.core.photo import read_mask, read_radiance
from patina.core.scan.mesh import read_mesh
from patina.core.scan.readers.colmap import read_colmap
from tests import make_capture as made

FILES = ("cameras.bin", "images.bin", "frames.bin", "rigs.bin", "points3D.bin")


@pytest.fixture(scope="module")
def model(tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("colmap") / "sparse"
    made.write_colmap(folder, 4)
    return folder


def damaged_copy(model: Path, folder: Path, name: str, change: Callable[[bytes], bytes]) -> Path:
    copy = folder / "broken"
    shutil.rmtree(copy, ignore_errors=True)
    shutil.copytree(model, copy)
    (copy / name).write_bytes(change((copy / name).read_bytes()))
    return copy


@pytest.mark.parametrize("name", FILES)
@settings(max_examples=40, deadline=5000, suppress_health_check=list(HealthCheck))
@given(part=st.floats(0, 1, exclude_max=True))
def test_truncated_colmap_models_are_rejected(
    model: Path, tmp_path: Path, name: str, part: float
) -> None:
    copy = damaged_copy(model, tmp_path, name, lambda data: data[: int(len(data) * part)])
    with pytest.raises(InputError, match=name):
        read_colmap(copy)


@pytest.mark.parametrize("name", FILES)
@settings(max_examples=40, deadline=5000, suppress_health_check=list(HealthCheck))
@given(data=st.data())
def test_changed_bytes_are_rejected_or_harmless(
    model: Path, tmp_path: Path, name: str, data: st.DataObject
) -> None:
    size = (model / name).stat().st_size
    place = data.draw(st.integers(0, size - 1))
    value = data.draw(st.integers(0, 255))
    copy = damaged_copy(
        model, tmp_path, name, lambda b: b[:place] + bytes([value]) + b[place + 1 :]
    )
    try:
        cameras = read_colmap(copy).cameras
    except InputError as error:
        assert "\n" not in str(error)
        return
    for camera in cameras:
        assert np.allclose(camera.pose.rotation @ camera.pose.rotation.T, np.eye(3), atol=1e-3)
        assert camera.lens.focal_length_x > 0


@pytest.mark.parametrize("count", [2**31, 2**40, 2**63, 2**64 - 1])
@pytest.mark.parametrize("name", FILES)
def test_impossible_counts_are_rejected(model: Path, tmp_path: Path, name: str, count: int) -> None:
    copy = damaged_copy(model, tmp_path, name, lambda data: struct.pack("<Q", count) + data[8:])
    with pytest.raises(InputError, match=name):
        read_colmap(copy)


def test_impossible_focal_lengths_are_rejected(model: Path, tmp_path: Path) -> None:
    focal = 8 + 4 + 4 + 16  # count, id, model, size
    for value in (-200.0, 0.0, float("nan"), float("inf")):
        copy = damaged_copy(
            model, tmp_path, "cameras.bin",
            lambda b, v=value: b[:focal] + struct.pack("<d", v) + b[focal + 8 :],
        )  # fmt: skip
        with pytest.raises(InputError):
            read_colmap(copy)
    text = tmp_path / "text"
    made.write_colmap(text, 2, text=True)
    cameras_text = (text / "cameras.txt").read_text()
    (text / "cameras.txt").write_text(cameras_text.replace("200", "-200"))
    with pytest.raises(InputError):
        read_colmap(text)


def test_real_colmap_models_are_read(shared: Path) -> None:
    models = shared / "data" / "cameras" / "colmap"
    counts = {p.name: len(read_colmap(p).cameras) for p in sorted(models.iterdir()) if p.is_dir()}
    assert set(counts.values()) == {11, 18} and len(counts) >= 4


def test_truncated_ply_is_rejected(tmp_path: Path) -> None:
    path = tmp_path / "mesh.ply"
    made.write_ply(path, *made.sphere_mesh(2))
    original = path.read_bytes()
    for part in np.linspace(0.02, 0.98, 23):
        path.write_bytes(original[: int(len(original) * part)])
        with pytest.raises(InputError, match=r"mesh\.ply"):
            read_mesh(path)


def test_invalid_obj_files_are_rejected(tmp_path: Path) -> None:
    path = tmp_path / "mesh.obj"
    for text in (
        "v 0 0 0\nv 1 0 0\nv 0 1 0\nf 0 1 2\n",
        "v 0 0\nv 1 0\nv 0 1\nf 1 2 3\n",
        "v 0 0 0\nv 1 0 0\nf 1 2 9\n",
        "v 0 0 0\n",
        "",
    ):
        path.write_text(text)
        with pytest.raises(InputError, match=r"mesh\.obj"):
            read_mesh(path)
    (tmp_path / "folder.obj").mkdir()
    with pytest.raises(InputError, match="not a file"):
        read_mesh(tmp_path / "folder.obj")


def write_channels(path: Path, names: list[str], pixels: np.ndarray, **more: int) -> None:
    spec = oiio.ImageSpec(pixels.shape[1], pixels.shape[0], len(names), "float")
    spec.channelnames = tuple(names)
    for key, value in more.items():
        setattr(spec, key, value)
    out = oiio.ImageOutput.create(str(path))
    out.open(str(path), spec)
    out.write_image(np.ascontiguousarray(pixels, np.float32))
    out.close()


def test_exr_channels_are_read_by_name(tmp_path: Path) -> None:
    path = tmp_path / "photo.exr"
    pixels = np.arange(4 * 5 * 4, dtype=np.float32).reshape(4, 5, 4)
    write_channels(path, ["R", "G", "B", "Z"], pixels)
    assert np.array_equal(read_radiance(path), pixels[..., :3])
    write_channels(path, ["Y"], pixels[..., :1])
    assert np.array_equal(read_radiance(path), np.repeat(pixels[..., :1], 3, axis=2))
    for names in (["Z", "N.X", "N.Y"], ["depth.V"]):
        write_channels(path, names, pixels[..., : len(names)])
        with pytest.raises(InputError, match="expected R, G and B"):
            read_radiance(path)


def test_cropped_and_mislabelled_photos_are_rejected(tmp_path: Path) -> None:
    path = tmp_path / "photo.exr"
    write_channels(path, ["R", "G", "B"], np.ones((4, 5, 3)), full_width=9, full_height=9)
    with pytest.raises(InputError, match="cropped"):
        read_radiance(path)
    made.write_png(tmp_path / "p.png", np.ones((4, 5)))
    path.write_bytes((tmp_path / "p.png").read_bytes())
    with pytest.raises(InputError, match="its format is png"):
        read_radiance(path)
    with pytest.raises(InputError, match="unknown suffix"):
        read_radiance(tmp_path / "p.bmp")


def test_damaged_masks_are_rejected_and_alpha_masks_are_read(
    tmp_path: Path, capfd: pytest.CaptureFixture[str]
) -> None:
    path = tmp_path / "mask.png"
    mask = np.zeros((6, 7))
    mask[2:4] = 255
    made.write_png(path, mask)
    assert np.array_equal(read_mask(path), mask > 0)
    original = path.read_bytes()
    for part in (0, 4, 20, len(original) // 2, len(original) - 3):
        path.write_bytes(original[:part])
        with pytest.raises(InputError, match=r"mask\.png"):
            read_mask(path)
    path.write_bytes(original[:45] + bytes([original[45] ^ 255]) + original[46:])
    with pytest.raises(InputError, match="damaged"):
        read_mask(path)
    assert capfd.readouterr().err == ""  # libpng prints nothing itself
    spec = oiio.ImageSpec(7, 6, 4, "uint8")
    out = oiio.ImageOutput.create(str(path))
    out.open(str(path), spec)
    rgba = np.full((6, 7, 4), 255, np.uint8)
    rgba[..., 3] = mask
    out.write_image(rgba)
    out.close()
    # a white image whose alpha channel is the mask
    assert np.array_equal(read_mask(path), mask > 0)


@pytest.mark.parametrize("damage", ["black", "negative", "far too bright"])
def test_photos_without_plausible_light_are_rejected(tmp_path: Path, damage: str) -> None:
    path = made.make_capture(tmp_path / "ball", photos=2)
    factor = {"black": 0.0, "negative": -1.0, "far too bright": 1e9}[damage]
    for photo in path.parent.glob("*.exr"):
        made.write_exr(photo, read_radiance(photo) * factor)
    with pytest.raises(PatinaError, match=r"photo 1\.file.*median BRDF"):
        FitJob(read_capture(path)).drain()


def test_invalid_npz_files_are_rejected(tmp_path: Path) -> None:
    path = tmp_path / "x.npz"
    for content in (b"", b"PK", b"not a zip"):
        path.write_bytes(content)
        with pytest.raises(InputError, match=r"x\.npz"):
            nbrdf.load(path)
    for weights in (np.full((1, 675), np.nan), np.ones((1, 5)), np.array([["a"]])):
        np.savez(path, names=np.array(["a"]), weights=weights)
        with pytest.raises(InputError, match=r"x\.npz"):
            nbrdf.load(path)


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("a = " + "[" * 3000, "capture file|TOML"),
        ("a = " + "9" * 5000, "capture file|TOML|too long"),
        ("a = 1\n" * 200_000, "too large"),
        (".".join("a" * 5001) + " = 1", "too long"),
        ('[scan]\ncameras = "' + "x" * 5000 + '"', r"scan\.cameras.*no such file"),
        ('[scan]\ncameras = "a\\u0000b"', r"scan\.cameras.*no such file"),
    ],
)
def test_hostile_capture_files_are_rejected(tmp_path: Path, text: str, message: str) -> None:
    path = tmp_path / "x.capture.toml"
    path.write_text(text)
    with pytest.raises(InputError, match=message) as caught:
        read_capture(path)
    assert "\n" not in str(caught.value)


MATERIALS = {
    "con": "file name",
    "a/b": "file name",
    "a\\tb": "file name",
    "x" * 300: "file name",
    "a\\u202Eb": "file name",
    "shadow": "reserved for masks",
    "highlight": "reserved for masks",
    "ignore": "reserved for masks",
}


@pytest.mark.parametrize("name", MATERIALS)
def test_invalid_material_names_are_rejected(tmp_path: Path, name: str) -> None:
    path = made.make_capture(tmp_path / "ball", photos=2, extra=f'[[material]]\nname = "{name}"')
    with pytest.raises(InputError, match=MATERIALS[name]):
        read_capture(path)


@pytest.mark.parametrize(
    ("extra", "message"),
    [
        ('[[material]]\nname = "Gold"\n[[material]]\nname = "gold"', "used twice"),
        ('[[material]]\nname = "a"\n[[material]]\nname = "b"', "both cover the whole object"),
        ("[fit]\nsamples = 30\nsubset = 10", r"fit\.subset"),
        ("[fit]\nshadow_margin = 1000", r"fit\.shadow_margin"),
        ("[fit]\neta = " + "9" * 400, r"fit\.eta"),
    ],
)
def test_impossible_settings_are_rejected(tmp_path: Path, extra: str, message: str) -> None:
    path = made.make_capture(tmp_path / "ball", photos=2, extra=extra)
    with pytest.raises(InputError, match=message):
        read_capture(path)


def test_byte_order_mark_and_crlf_are_accepted(tmp_path: Path) -> None:
    path = made.make_capture(tmp_path / "ball", photos=2)
    path.write_bytes(b"\xef\xbb\xbf" + path.read_bytes().replace(b"\n", b"\r\n"))
    assert len(read_capture(path).photos) == 2
