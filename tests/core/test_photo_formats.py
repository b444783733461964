"""Every file format: the right pixels, never rotated, or a one-line error with the cause."""

from __future__ import annotations

import random
import time
import tracemalloc
from collections.abc import Callable
from pathlib import Path

import numpy as np
import OpenImageIO as oiio
import pytest
from hypothesis import HealthCheck, example, given, settings
from hypothesis import strategies as st

from patina.core.errors import InputError
from patina.core.photo import (
    image_size,
    read_encoded,
    read_exif,
    read_mask,
    read_photo,
    read_radiance,
)
from tests import make_photos as made

HEIGHT, WIDTH = 24, 36


def ramp(dtype=np.uint8, channels: int = 3) -> np.ndarray:
    """No two rows, columns or channels are alike: a rotated or mixed up image differs."""
    y, x, c = np.mgrid[:HEIGHT, :WIDTH, :channels]
    part = (0.55 * y / HEIGHT + 0.3 * x / WIDTH + 0.1 * c / max(channels, 1)) + 0.02
    return (part * np.iinfo(dtype).max).astype(dtype) if np.dtype(dtype).kind == "u" else part


def write(path: Path, pixels: np.ndarray, kind: str, tile: int = 0, **more) -> Path:
    data = np.ascontiguousarray(np.atleast_3d(pixels))
    spec = oiio.ImageSpec(data.shape[1], data.shape[0], data.shape[2], kind)
    spec.tile_width = spec.tile_height = tile
    for key, value in more.items():
        spec.attribute(key.replace("__", ":"), value)
    out = oiio.ImageOutput.create(str(path))
    assert out.open(str(path), spec) and out.write_image(data), out.geterror()
    out.close()
    return path


@pytest.mark.parametrize("orientation", [1, 3, 6, 8])
def test_orientation_is_never_applied(tmp_path: Path, orientation: int) -> None:
    truth = ramp() / 255
    tags = {274: (3, [orientation])}
    made.write_tiff(tmp_path / "p.tif", ramp(), tags)
    made.write_jpeg(tmp_path / "p.jpg", ramp(), (made.app1_exif(made.tiff_bytes(tags)),))
    made.write_png(tmp_path / "p.png", ramp(), [(b"eXIf", made.tiff_bytes(tags))])
    write(tmp_path / "p.exr", ramp(np.float32), "float", Orientation=orientation)
    write(tmp_path / "o.jpg", ramp(), "uint8", Orientation=orientation)
    for name in ("p.tif", "p.jpg", "p.png", "p.exr", "o.jpg"):
        path = tmp_path / name
        photo = read_photo(path, "linear")
        lossy = 0.03 if name.endswith("jpg") else 0.005
        assert np.abs(photo.radiance - truth).max() < lossy, name
        assert np.abs(read_encoded(path) - truth).max() < lossy
        assert image_size(path) == (WIDTH, HEIGHT)
        assert read_exif(path).orientation == orientation


def test_tiff_layouts(tmp_path: Path) -> None:
    path = tmp_path / "p.tif"
    for kind, dtype in (("uint8", np.uint8), ("uint16", np.uint16)):
        pixels, top = ramp(dtype), np.iinfo(dtype).max
        for tile in (0, 16):
            for planar in ("contig", "separate"):
                for compression in ("none", "zip", "lzw"):
                    write(path, pixels, kind, tile, planarconfig=planar, compression=compression)
                    light = read_radiance(path, "linear")
                    assert np.abs(light * top - pixels).max() < 0.01, (kind, tile, planar)
    for order in "<>":
        made.write_tiff(path, ramp(np.uint16), order=order)
        assert np.abs(read_radiance(path, "linear") * 65535 - ramp(np.uint16)).max() < 0.01


@pytest.mark.parametrize("compression", ["none", "rle", "zip", "piz", "pxr24"])
@pytest.mark.parametrize("tile", [0, 16])
def test_exr_layouts(tmp_path: Path, compression: str, tile: int) -> None:
    rng = np.random.default_rng(3)
    light = rng.random((300, 40, 3)).astype(np.float16)  # more rows than are read at once
    write(tmp_path / "p.exr", light, "half", tile, compression=compression)
    assert np.array_equal(read_radiance(tmp_path / "p.exr"), light.astype(np.float32))


def test_image_with_more_rows_than_one_block(tmp_path: Path) -> None:
    rng = np.random.default_rng(4)
    pixels = rng.integers(0, 256, (700, 9, 3), np.uint8)
    made.write_tiff(tmp_path / "p.tif", pixels)
    write(tmp_path / "t.tif", pixels, "uint8", 16)
    made.write_png(tmp_path / "p.png", pixels)
    for name in ("p.tif", "t.tif", "p.png"):
        photo = read_photo(tmp_path / name, "linear")
        assert np.abs(photo.radiance * 255 - pixels).max() < 1e-3
        assert np.array_equal(photo.clipped, (pixels >= 253).any(axis=2))
        assert np.array_equal(photo.black, (pixels == 0).any(axis=2))


@pytest.mark.parametrize("dtype", [np.uint8, np.uint16])
def test_grey_and_alpha(tmp_path: Path, dtype) -> None:
    top = np.iinfo(dtype).max
    for channels in (1, 2, 3, 4):
        pixels = ramp(dtype, channels)
        if channels in (2, 4):
            pixels[..., -1] = np.linspace(0, top, WIDTH)  # transparent on the left
        made.write_png(tmp_path / "p.png", pixels)
        made.write_tiff(tmp_path / "p.tif", pixels)
        colour = pixels[..., :3] if channels > 2 else np.repeat(pixels[..., :1], 3, axis=2)
        for name in ("p.png", "p.tif"):
            for got in (read_radiance(tmp_path / name, "linear"), read_encoded(tmp_path / name)):
                assert got.shape == (HEIGHT, WIDTH, 3)
                assert np.abs(got * top - colour).max() < 0.01, (name, channels)


def test_palettes_and_low_bit_depths(tmp_path: Path) -> None:
    path = tmp_path / "p.png"
    codes = np.tile(np.arange(4), (3, 5))
    palette = [0, 0, 0, 10, 20, 30, 100, 110, 120, 255, 254, 253]
    made.write_png(path, codes, bits=2, palette=palette)
    truth = np.array(palette).reshape(4, 3)[codes]
    assert np.abs(read_radiance(path, "linear") * 255 - truth).max() < 1e-3
    for bits in (1, 2, 4):
        grey = np.tile(np.arange(2**bits), (3, 4))
        made.write_png(path, grey, bits=bits)
        light = read_radiance(path, "linear")
        assert np.allclose(light[..., 1], grey / (2**bits - 1), atol=1e-6)
    one = np.tile([0, 1, 1, 0, 1, 0, 0, 0], (2, 1))
    for white_is_zero in (0, 1):
        body = np.packbits(one, axis=1).tobytes()
        tags = {
            256: (4, [8]), 257: (4, [2]), 258: (3, [1]), 259: (3, [1]),
            262: (3, [1 - white_is_zero]), 277: (3, [1]), 278: (4, [2]),
        }  # fmt: skip
        (tmp_path / "p.tif").write_bytes(made.tiff_bytes(tags, pixels=body))
        light = read_radiance(tmp_path / "p.tif")
        assert np.array_equal(light[..., 0], np.abs(one - white_is_zero))


def test_pages(tmp_path: Path) -> None:
    path = tmp_path / "p.tif"
    write(path, ramp(), "uint8")
    out = oiio.ImageOutput.create(str(path))
    specs = [oiio.ImageSpec(WIDTH, HEIGHT, 3, "uint8"), oiio.ImageSpec(5, 5, 3, "uint8")]
    out.open(str(path), specs[0])
    out.write_image(ramp())
    out.open(str(path), specs[1], "AppendSubimage")
    out.write_image(np.zeros((5, 5, 3), np.uint8))
    out.close()
    photo = read_photo(path, "linear")
    assert np.abs(photo.radiance * 255 - ramp()).max() < 1e-3
    assert any("pages" in note for note in photo.info.notes)


RGBE = np.array([[[128, 64, 32, 129], [255, 255, 255, 128]], [[0, 0, 0, 0], [200, 1, 3, 140]]])
# G. Ward: mantissa / 256 · 2^(exponent − 128); some readers add half a step
RGBE_LIGHT = RGBE[..., :3] * 2.0 ** (RGBE[..., 3:] - 136.0)
RGBE_STEP = 2.0 ** (RGBE[..., 3:] - 136.0)


@pytest.mark.parametrize(
    ("lines", "scale"),
    [
        ([], 1.0),
        (["EXPOSURE=4"], 4.0),
        (["EXPOSURE=  0.5", "EXPOSURE=8"], 4.0),
        (["COLORCORR= 1 2 4", "EXPOSURE=2"], np.array([2.0, 4.0, 8.0])),
        (["# EXPOSURE=3"], 1.0),
    ],
)
def test_hdr_exposure(tmp_path: Path, lines, scale) -> None:
    path = tmp_path / "p.hdr"
    made.write_hdr(path, RGBE, lines)
    light = read_radiance(path) * scale
    assert (np.abs(light - RGBE_LIGHT) <= 0.51 * RGBE_STEP).all()


@pytest.mark.parametrize(
    ("lines", "resolution", "message"),
    [
        (["EXPOSURE=0"], None, "has the EXPOSURE"),
        (["EXPOSURE=x"], None, "has the EXPOSURE"),
        (["EXPOSURE=1e-20", "EXPOSURE=1e-20"], None, "out of range"),
        (["COLORCORR=1"], None, "has the EXPOSURE or COLORCORR"),
        ([], "+Y 2 +X 2", "resolution"),
        ([], "-Y 2 -X 2", "resolution"),
        ([], "+X 2 -Y 2", "resolution"),
        ([], "-Y 999999 +X 999999", "999999"),
        ([], "", "resolution|image"),
    ],
)
def test_invalid_hdr_headers(tmp_path: Path, lines, resolution, message: str) -> None:
    path = tmp_path / "p.hdr"
    made.write_hdr(path, RGBE, lines, " " if resolution == "" else resolution)
    with pytest.raises(InputError, match=message):
        read_radiance(path)
    text = path.read_bytes().replace(b"rle_rgbe", b"rle_xyze")
    path.write_bytes(text)
    with pytest.raises(InputError, match="XYZE"):
        read_radiance(path)


def test_clipping(tmp_path: Path) -> None:
    pixels = np.full((4, 6, 3), 100, np.uint8)
    pixels[1, 2, 0], pixels[2, 3, 2], pixels[3, 4, 1], pixels[0, 0] = 255, 253, 252, 0
    made.write_png(tmp_path / "p.png", pixels)
    photo = read_photo(tmp_path / "p.png")
    assert [tuple(p) for p in np.argwhere(photo.clipped)] == [(1, 2), (2, 3)]
    assert [tuple(p) for p in np.argwhere(photo.black)] == [(0, 0)]
    write(tmp_path / "p.exr", pixels / np.float32(10), "float")
    assert not read_photo(tmp_path / "p.exr").clipped.any()
    photo = read_photo(tmp_path / "p.exr", saturation=25.5)
    assert photo.clipped.sum() == 2 and photo.info.saturation == 25.5


def cmyk_jpeg(path: Path) -> None:
    made.write_jpeg(path, ramp())
    data = bytearray(path.read_bytes())
    frame = data.index(b"\xff\xc0")
    data[frame + 9] = 4
    path.write_bytes(bytes(data))


def copied_as(name: str) -> Callable[[Path], None]:
    def make(path: Path) -> None:
        other = path.with_name("other" + name)
        if name == ".png":
            made.write_png(other, ramp())
        else:
            made.write_jpeg(other, ramp())
        path.write_bytes(other.read_bytes())

    return make


def tiff_of(photometric: int, **more) -> Callable[[Path], None]:
    tags = {262: (3, [photometric])}
    return lambda path: made.write_tiff(path, ramp(np.uint8, more.get("channels", 3)), tags)


def absurd_tiff(path: Path) -> None:
    made.write_tiff(path, ramp(), {256: (4, [150000]), 257: (4, [150000])})


def absurd_png(path: Path) -> None:
    made.write_png(path, ramp())
    data = path.read_bytes()
    head = (1 << 30).to_bytes(4, "big") * 2 + data[24:29]
    path.write_bytes(data[:8] + made.chunk(b"IHDR", head) + data[33:])


def wide_tiff(path: Path) -> None:
    write(path, np.ones((4, 4, 3), np.uint32), "uint")


def broken_exr(path: Path) -> None:
    light = np.ones((4, 5, 3), np.float32)
    light[2, 3, 1], light[0] = np.inf, np.nan
    write(path, light, "float")


@pytest.mark.parametrize(
    ("name", "make", "message"),
    [
        ("p.jpg", cmyk_jpeg, "CMYK"),
        ("p.jpg", copied_as(".png"), "the suffix .jpg but its format is png"),
        ("p.png", copied_as(".jpg"), "the suffix .png but its format is jpeg"),
        ("p.tif", copied_as(".jpg"), "the suffix .tif but its format is jpeg"),
        ("p.exr", copied_as(".jpg"), "the suffix .exr but its format is jpeg"),
        ("p.hdr", lambda path: path.write_bytes(b"not at all"), "not HDR"),
        ("p.jpg", lambda path: path.write_bytes(b""), "not JPEG"),
        ("p.tif", tiff_of(5, channels=4), "CMYK"),
        ("p.tif", tiff_of(8), r"L\*a\*b"),
        ("p.tif", tiff_of(32803), "mosaic"),
        ("p.tif", absurd_tiff, "150000 × 150000|cannot|not a"),
        ("p.png", absurd_png, "1073741824|not a readable"),
        ("p.tif", wide_tiff, "pixels of type uint"),
        ("p.exr", broken_exr, "6 pixels that are NaN"),
        ("p.webp", lambda path: path.write_bytes(b"RIFF"), "unknown suffix .*; expected .exr"),
        ("p", lambda path: path.write_bytes(b"x"), "unknown suffix"),
        ("p.jpg", lambda path: path.mkdir(), "not a file"),
        ("p.jpg", lambda path: None, "no such file"),
    ],
)
def test_unsupported_images_are_rejected(tmp_path: Path, name: str, make, message: str) -> None:
    make(tmp_path / name)
    with pytest.raises(InputError, match=message) as raised:
        read_photo(tmp_path / name)
    assert "\n" not in str(raised.value) and name in str(raised.value)


def write_seed_files(folder: Path) -> dict[str, Path]:
    """One small file of every format and of the layouts that take different code paths."""
    exif = made.tiff_bytes({274: (3, [6])}, exif={0x829A: made.rationals((1, 50))})
    app = (made.app1_exif(exif), made.app2_icc(made.icc_profile(made.curv(563), made.ADOBE_D50)))
    light = ramp(np.float32)
    made.write_jpeg(folder / "p.jpg", ramp(), app, quality=90)
    write(folder / "progressive.jpg", ramp(), "uint8", jpeg__progressive=1)
    made.write_png(folder / "p.png", ramp(), [(b"gAMA", b"\0\0\xb1\x8f"), (b"eXIf", exif)])
    made.write_tiff(folder / "p.tif", ramp(np.uint16), gps={1: made.ascii_tag("N")})
    write(folder / "tiled.tif", ramp(), "uint8", 16, compression="zip", planarconfig="separate")
    write(folder / "lzw.tif", ramp(), "uint8", compression="lzw")
    write(folder / "p.exr", light, "half", compression="zip")
    write(folder / "piz.exr", light, "float", 16, compression="piz")
    write(folder / "p.hdr", light, "float")
    made.write_hdr(folder / "flat.hdr", RGBE, ["EXPOSURE=2"])
    return {path.name: path for path in sorted(folder.iterdir())}


NAMES = [
    "flat.hdr", "lzw.tif", "p.exr", "p.hdr", "p.jpg", "p.png", "p.tif", "piz.exr",
    "progressive.jpg", "tiled.tif",
]  # fmt: skip


@pytest.fixture(scope="module")
def valid_files(tmp_path_factory: pytest.TempPathFactory) -> dict[str, Path]:
    found = write_seed_files(tmp_path_factory.mktemp("seeds"))
    assert sorted(found) == NAMES
    return found


def check_all_readers(path: Path) -> bool:
    """Run every reader: pixels of the header's size, or a one-line error, in bounded time.

    Returns whether pixels came.
    """
    start, read = time.perf_counter(), False
    for reader in (read_photo, read_exif, read_mask, read_encoded):
        try:
            found = reader(path)
        except InputError as error:
            assert "\n" not in str(error) and path.name in str(error)
        else:
            if reader is read_photo:
                read = True
                width, height = image_size(path)
                assert found.radiance.shape == (height, width, 3)
                assert found.clipped.shape == found.black.shape == (height, width)
                assert np.isfinite(found.radiance).all()
    assert time.perf_counter() - start < 5
    return read


@pytest.mark.parametrize("name", NAMES)
def test_truncated_files(
    valid_files: dict[str, Path], tmp_path: Path, name: str, capfd: pytest.CaptureFixture[str]
) -> None:
    data = valid_files[name].read_bytes()
    rng = random.Random(name)
    for _ in range(50):
        (tmp_path / name).write_bytes(data[: rng.randrange(len(data) - 2)])
        # the end of a strip that the last row does not need may be missing
        assert not check_all_readers(tmp_path / name)
    assert capfd.readouterr().err == ""


@pytest.mark.parametrize("name", NAMES)
@settings(max_examples=80, deadline=None, suppress_health_check=list(HealthCheck))
@given(
    places=st.lists(
        st.tuples(st.floats(0, 1, exclude_max=True), st.booleans(), st.integers(0, 255)),
        min_size=1,
        max_size=8,
    )
)
@example(places=[(0.02, False, 255)])
@example(places=[(0.5, True, 0), (0.0, True, 255)])
def test_flipped_bytes(valid_files: dict[str, Path], tmp_path: Path, name: str, places) -> None:
    data = bytearray(valid_files[name].read_bytes())
    for part, in_head, value in places:
        reach = min(len(data), 400) if in_head else len(data)
        data[int(part * reach)] = value
    (tmp_path / name).write_bytes(bytes(data))
    check_all_readers(tmp_path / name)


@pytest.mark.slow
def test_memory_of_a_large_photo(tmp_path: Path) -> None:
    """24 MP: the result (288 MB and two masks) and little more."""
    path = tmp_path / "p.tif"
    row = np.tile(np.arange(6000) % 256, (16, 1)).astype(np.uint8)
    spec = oiio.ImageSpec(6000, 4000, 3, "uint8")
    out = oiio.ImageOutput.create(str(path))
    out.open(str(path), spec)
    for top in range(0, 4000, 16):
        out.write_scanlines(top, top + 16, 0, np.repeat(row[..., None], 3, axis=2))
    out.close()
    tracemalloc.start()
    try:
        photo = read_photo(path)
        _, peak = tracemalloc.get_traced_memory()
    finally:
        tracemalloc.stop()
    assert photo.radiance.shape == (4000, 6000, 3)
    assert 288e6 < peak < 288e6 + 2 * 24e6 + 100e6
