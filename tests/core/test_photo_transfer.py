"""Encoded values → linear light: curves, embedded profiles, and encodings that files state."""

from __future__ import annotations

import struct
import zlib
from pathlib import Path

import numpy as np
import OpenImageIO as oiio
import pytest
from hypothesis import example, given, settings
from hypothesis import strategies as st

from patina.core.errors import InputError
from patina.core.photo import Transfer, read_photo
from patina.core.photo.icc import read_profile
from patina.core.photo.primaries import from_chromaticities
from tests import make_photos as made

CODES = np.arange(256, dtype=np.uint8)
STRIP = np.repeat(np.repeat(CODES[None, :, None], 4, axis=0), 3, axis=2)
PROPHOTO = (0.7347, 0.2653, 0.1596, 0.8404, 0.0366, 0.0001, 0.3457, 0.3585)


def srgb(x):
    """IEC 61966-2-1, written out."""
    return np.where(x <= 0.04045, x / 12.92, ((x + 0.055) / 1.055) ** 2.4)


def bt709(x):
    return np.where(x < 0.081, x / 4.5, ((x + 0.099) / 1.099) ** (1 / 0.45))


TRUTH = {
    "srgb": srgb,
    "linear": lambda x: x,
    "gamma:2.2": lambda x: x**2.2,
    "bt709": bt709,
}


@pytest.mark.parametrize("name", TRUTH)
def test_transfer_curves_match_standards(name: str) -> None:
    table = Transfer.named(name).table(65536)
    assert table.shape == (65536, 3) and table.dtype == np.float32
    truth = TRUTH[name](np.arange(65536) / 65535)
    assert np.abs(table - truth[:, None]).max() < 1e-6
    x = np.linspace(0, 3, 300).reshape(10, 10, 3)  # floats may exceed 1
    assert np.allclose(Transfer.named(name).decode(x), TRUTH[name](x), rtol=1e-5, atol=1e-6)


@pytest.mark.parametrize("name", ["", "sRGB ", "gamma", "gamma:", "gamma:0", "gamma:nan", "lut"])
def test_unknown_curves_are_rejected(name: str) -> None:
    with pytest.raises(InputError, match=r'expected "auto", "srgb"'):
        Transfer.named(name)


@settings(max_examples=60, deadline=None)
@given(
    st.lists(st.floats(0.01, 1), min_size=1, max_size=30),
    st.lists(st.floats(0, 1), min_size=30, max_size=30),
)
def test_sampled_curves_interpolate_points_monotonically(steps, rises) -> None:
    x = np.cumsum([0.0, *steps])
    x /= x[-1]
    y = np.cumsum([0.0, *rises[: len(steps)]]) + x
    curve = Transfer.sampled(x, y)
    points = np.repeat(x[:, None], 3, axis=1)
    assert np.allclose(curve.decode(points), y[:, None], atol=1e-5 * y[-1])
    assert (np.diff(curve.table(1001), axis=0) >= 0).all()


def test_sampled_curves_per_channel_and_invalid_ones() -> None:
    x = np.linspace(0, 1, 50)
    curve = Transfer.sampled(np.tile(x, (3, 1)), [x, 2 * x, srgb(x)])
    got = curve.decode(np.full((1, 3), 0.5))
    assert np.allclose(got, [[0.5, 1.0, srgb(0.5)]], atol=2e-3)
    for encoded, linear in (
        ([0, 1], [0, 1, 2]),
        ([0.5], [0.5]),
        ([0, 0.5, 0.5, 1], [0, 1, 2, 3]),
        ([0, 0.5, 1], [0, 2, 1]),
        ([0, 1], [1, 1]),
        ([0, np.nan], [0, 1]),
        (np.zeros((2, 5)), np.zeros((2, 5))),
    ):
        with pytest.raises(InputError, match="sampled transfer curve"):
            Transfer.sampled(encoded, linear)


@pytest.mark.parametrize("name", TRUTH)
def test_requested_curve_overrides_file(tmp_path: Path, name: str) -> None:
    made.write_png(tmp_path / "p.png", STRIP, [(b"sRGB", b"\0")])
    photo = read_photo(tmp_path / "p.png", name)
    assert np.abs(photo.radiance[1, :, 0] - TRUTH[name](CODES / 255)).max() < 1e-6
    assert photo.info.reason == "set by the user"


@pytest.mark.parametrize("bits", [8, 16])
def test_srgb_is_assumed_by_default(tmp_path: Path, bits: int) -> None:
    strip = STRIP if bits == 8 else STRIP.astype(np.uint16) * 257
    made.write_tiff(tmp_path / "p.tif", strip)
    made.write_png(tmp_path / "p.png", strip)
    for name in ("p.tif", "p.png"):
        photo = read_photo(tmp_path / name)
        assert np.abs(photo.radiance[2] - srgb(CODES / 255)[:, None]).max() < 1e-6
        assert "declares no curve" in photo.info.reason
        assert any("linear" in note for note in photo.info.notes) == (bits == 16)
        assert photo.info.saturation == 1.0 and photo.info.levels == 2**bits


def test_float_images_are_linear(tmp_path: Path) -> None:
    light = np.geomspace(1e-4, 1e3, 96, dtype=np.float32).reshape(4, 8, 3)
    made.write_tiff(tmp_path / "p.tif", light)
    made.write_tiff(tmp_path / "big.tif", light, order=">")
    for name in ("p.tif", "big.tif"):
        assert np.array_equal(read_photo(tmp_path / name).radiance, light)


def gama(number: int) -> tuple[bytes, bytes]:
    return b"gAMA", struct.pack(">I", number)


def iccp(profile: bytes) -> tuple[bytes, bytes]:
    return b"iCCP", b"x\0\0" + zlib.compress(profile)


GAMMA18 = made.icc_profile(made.curv(round(1.8 * 256)), made.SRGB_D50)


@pytest.mark.parametrize(
    ("chunks", "truth"),
    [
        ([(b"sRGB", b"\0"), gama(100000)], srgb),
        ([gama(45455)], srgb),
        ([gama(100000)], lambda x: x),
        ([gama(55556)], lambda x: x**1.8),
        ([gama(0)], srgb),
        ([iccp(GAMMA18)], lambda x: x**1.80078125),
        ([iccp(b"nonsense")], srgb),
        ([iccp(b"nonsense"), gama(100000)], lambda x: x),
        ([(b"cICP", b"\1\x08\0\1"), (b"sRGB", b"\0")], lambda x: x),
        ([(b"cICP", b"\1\x10\0\1")], srgb),  # the PQ curve is not supported
    ],
)
def test_transfer_stated_by_png(tmp_path: Path, chunks, truth) -> None:
    made.write_png(tmp_path / "p.png", STRIP, chunks)
    light = read_photo(tmp_path / "p.png").radiance
    assert np.abs(light[0] - truth(CODES / 255)[:, None]).max() < 1e-4


def test_transfer_stated_by_exif(tmp_path: Path) -> None:
    path = tmp_path / "p.jpg"
    colours = np.zeros((16, 16, 3), np.uint8)
    colours[:] = (60, 200, 90)
    for space, index, adobe in ((1, "R98", False), (2, "R03", True), (0xFFFF, "R03", True)):
        exif = {0xA001: (3, [space])}
        tiff = made.tiff_bytes({}, exif=exif)
        # the interoperability directory, placed after everything else
        tiff = made.tiff_bytes({}, exif={**exif, 0xA005: (4, [len(tiff) + 12])})
        tiff += made.tiff_bytes({1: made.ascii_tag(index)})[8:]
        made.write_jpeg(path, colours, (made.app1_exif(tiff),))
        light = read_photo(path).radiance.mean(axis=(0, 1))
        encoded = np.array([60, 200, 90]) / 255
        if adobe:  # published Adobe RGB (1998) → sRGB, D65
            linear = encoded ** (2 + 51 / 256)
            matrix = [[1.39836, -0.39836, 0], [0, 1, 0], [0, -0.04293, 1.04293]]
            truth = np.array(matrix) @ linear
        else:
            truth = srgb(encoded)
        assert np.allclose(light, truth, atol=0.006), (space, index)


def test_icc_profile_curves() -> None:
    x = np.linspace(0, 1, 397)
    # the five function types of ICC.1, table 68, written out
    kinds = {
        made.curv(): x,
        made.curv(563): x ** (563 / 256),
        made.curv(*np.round(65535 * srgb(np.linspace(0, 1, 1024))).astype(int)): srgb(x),
        made.para(0, 1.8): x**1.8,
        made.para(1, 2.0, 0.8, 0.2): (0.8 * x + 0.2) ** 2,
        made.para(1, 2.0, 1.25, -0.25): np.where(x >= 0.2, (1.25 * x - 0.25) ** 2, 0),
        made.para(2, 2.0, 0.5, 0.2, 0.3): (0.5 * x + 0.2) ** 2 + 0.3,
        made.para(3, 2.4, 1 / 1.055, 0.055 / 1.055, 1 / 12.92, 0.04045): srgb(x),
        made.para(4, 2.0, 0.8, 0.1, 0.4, 0.3, 0.05, 0.02): np.where(
            x >= 0.3, (0.8 * x + 0.1) ** 2 + 0.05, 0.4 * x + 0.02
        ),
    }
    for tag, truth in kinds.items():
        for space in (b"RGB ", b"GRAY"):
            profile = read_profile(made.icc_profile(tag, made.SRGB_D50, space))
            assert profile is not None and profile.name == "made"
            assert profile.matrix is None  # sRGB's own primaries
            for curve in profile.curves:
                assert np.abs(curve(x) - truth).max() < 2e-4


def test_icc_profiles_without_simple_curves() -> None:
    good = made.icc_profile(made.curv(563), made.SRGB_D50)
    assert read_profile(good) is not None
    flat = made.icc_profile(made.curv(0), made.SRGB_D50)
    falling = made.icc_profile(made.curv(65535, 0), made.SRGB_D50)
    line = made.icc_profile(made.curv(563), np.ones((3, 3)))
    lut = good.replace(b"rTRC", b"A2B0")
    for data in (b"", good[:100], good.replace(b"RGB ", b"CMYK"), flat, falling, line, lut):
        assert read_profile(data) is None


@settings(max_examples=150, deadline=None)
@given(st.data())
def test_damaged_icc_profiles(data: st.DataObject) -> None:
    whole = made.icc_profile(made.para(3, 2.4, 0.9, 0.1, 0.08, 0.04), made.ADOBE_D50)
    damaged = bytearray(whole[: data.draw(st.integers(0, len(whole)))])
    for _ in range(data.draw(st.integers(0, 4))):
        if damaged:
            damaged[data.draw(st.integers(0, len(damaged) - 1))] = data.draw(st.integers(0, 255))
    profile = read_profile(bytes(damaged))
    if profile is not None:
        for curve in profile.curves:
            assert np.isfinite(curve(np.linspace(0, 1, 65))).all()
        assert profile.matrix is None or np.allclose(profile.matrix.sum(axis=1), 1)


@settings(max_examples=100, deadline=None)
@given(st.binary(max_size=300))
@example(b"\0" * 300)
def test_arbitrary_bytes_as_icc_profile(data: bytes) -> None:
    read_profile(b"\0" * 36 + b"acsp" + data)


def test_primaries_of_icc_profile_are_converted(tmp_path: Path) -> None:
    """A colour does not depend on the RGB space it is stored in: the expected value goes through
    XYZ.
    """
    profile = made.icc_profile(made.curv(563), made.ADOBE_D50)
    made.write_tiff(tmp_path / "p.tif", STRIP, {34675: (7, profile)})
    made.write_jpeg(tmp_path / "p.jpg", STRIP, (made.app2_icc(profile),))
    for name in ("p.tif", "p.jpg"):
        light = read_photo(tmp_path / name).radiance
        grey = (CODES / 255) ** (563 / 256)
        assert np.abs(light[0] - grey[:, None]).max() < (1e-5 if name == "p.tif" else 0.02)
    colour = np.zeros((4, 4, 3), np.uint8)
    colour[:] = (51, 204, 102)
    made.write_tiff(tmp_path / "c.tif", colour, {34675: (7, profile)})
    light = read_photo(tmp_path / "c.tif").radiance[0, 0]
    xyz = made.ADOBE_D50 @ (np.array([51, 204, 102]) / 255) ** (563 / 256)
    assert np.allclose(made.SRGB_D50 @ light, xyz, atol=1e-3)


def test_matrices_match_published_values() -> None:
    prophoto = [[2.0343, -0.7275, -0.3068], [-0.2288, 1.2317, -0.0029], [-0.0086, -0.1533, 1.1618]]
    assert np.allclose(from_chromaticities(PROPHOTO), prophoto, atol=1e-3)
    assert from_chromaticities((0.64, 0.33, 0.30, 0.60, 0.15, 0.06, 0.3127, 0.3290)) is None
    with pytest.raises(ValueError):
        from_chromaticities((0.3, 0.3, 0.3, 0.3, 0.3, 0.3, 0.3, 0.3))
    with pytest.raises(ValueError):
        from_chromaticities((0.64, 0.0, 0.3, 0.6, 0.15, 0.06, 0.3127, 0.329))


def test_exr_chromaticities_are_converted(tmp_path: Path) -> None:
    path = tmp_path / "p.exr"
    light = np.random.default_rng(0).random((6, 7, 3), np.float32)
    for chromaticities, matrix in ((None, np.eye(3)), (PROPHOTO, from_chromaticities(PROPHOTO))):
        spec = oiio.ImageSpec(7, 6, 3, "float")
        if chromaticities:
            spec.attribute("chromaticities", oiio.TypeDesc("float[8]"), chromaticities)
        out = oiio.ImageOutput.create(str(path))
        out.open(str(path), spec)
        out.write_image(light)
        out.close()
        photo = read_photo(path)
        assert np.allclose(photo.radiance, light @ np.asarray(matrix).T, atol=1e-5)
        assert ("converted" in photo.info.reason) == (chromaticities is not None)


def test_raw_processing_is_reported(shared: Path) -> None:
    path = shared / "data/real/rodin_bronze/colorchecker/231016_miaEURO_9505.jpg"
    photo = read_photo(path)
    assert photo.info.transfer.name == "srgb" and "colour profile" in photo.info.reason
    assert any("Shadows +93" in note and "Blacks +86" in note for note in photo.info.notes)
