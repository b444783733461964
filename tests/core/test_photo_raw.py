"""Camera RAW files, against mosaics of known light."""

from __future__ import annotations

import sys
from pathlib import Path

import numpy as np
import pytest

from patina.core.errors import InputError
from patina.core.photo import image_size, read_exif, read_photo, read_radiance
from tests import make_photos as made

HEIGHT, WIDTH = 96, 128
BLACK, WHITE = 64, 4095
NEUTRAL = np.array([0.5, 1.0, 0.625])
CAMERA = np.array([[0.7, 0.2, 0.1], [0.1, 0.8, 0.1], [0.05, 0.25, 0.7]])
COLOUR = np.array([0.3, 0.4, 0.2])


def mosaic(light: np.ndarray, camera=None) -> np.ndarray:
    """(h, w) sensor values of (h, w, 3) linear Rec.709 light, 1 = saturation of green."""
    y, x = np.mgrid[:HEIGHT, :WIDTH]
    channel = np.where((y % 2 == 0) & (x % 2 == 0), 0, np.where((y % 2) & (x % 2), 2, 1))
    seen = (light @ (np.eye(3) if camera is None else camera).T) * NEUTRAL
    number = BLACK + (WHITE - BLACK) * np.take_along_axis(seen, channel[..., None], 2)[..., 0]
    return np.clip(np.round(number), 0, WHITE)


def shaded() -> np.ndarray:
    y, x = np.mgrid[:HEIGHT, :WIDTH]
    return (0.4 + 0.4 * x / WIDTH + 0.2 * y / HEIGHT)[..., None] * COLOUR


@pytest.mark.parametrize("orientation", [1, 3, 6, 8])
@pytest.mark.parametrize("camera", [None, CAMERA])
def test_linear_light_is_recovered_from_mosaic(tmp_path: Path, orientation: int, camera) -> None:
    pytest.importorskip("rawpy")
    path = tmp_path / "p.dng"
    more = {} if camera is None else {"camera": camera}
    made.write_dng(path, mosaic(shaded(), camera), orientation=orientation, **more)
    assert image_size(path) == (WIDTH, HEIGHT)
    photo = read_photo(path)
    inner = np.s_[6:-6, 6:-6]
    assert np.allclose(photo.radiance[inner], shaded()[inner], rtol=0.01)
    assert not photo.clipped.any()
    assert read_exif(path).orientation == orientation
    assert photo.info.white_balance == pytest.approx((2, 1, 1.6))
    assert photo.info.kind == "raw" and "AHD" in photo.info.reason


def test_brightness_is_not_rescaled_to_photo(tmp_path: Path) -> None:
    """The photo itself sets no scale: half the light gives half the values, and a photo whose
    brightest pixel lies just below saturation is not stretched.
    """
    pytest.importorskip("rawpy")
    means = []
    for factor in (1.0, 0.5, 2.2):
        made.write_dng(tmp_path / "p.dng", mosaic(shaded() * factor))
        means.append(read_radiance(tmp_path / "p.dng")[20:-20, 20:-20].mean())
    assert means[1] / means[0] == pytest.approx(0.5, rel=2e-3)
    assert means[2] / means[0] == pytest.approx(2.2, rel=2e-3)


def test_saturation(tmp_path: Path) -> None:
    pytest.importorskip("rawpy")
    numbers = mosaic(shaded())
    numbers[40:44, 50:54] = WHITE
    made.write_dng(tmp_path / "p.dng", numbers)
    photo = read_photo(tmp_path / "p.dng")
    assert photo.clipped[40:44, 50:54].all()
    around = np.zeros_like(photo.clipped)
    around[36:48, 46:58] = True
    assert not photo.clipped[~around].any()
    assert any(f"saturates at {WHITE - BLACK}" in note for note in photo.info.notes)


def test_damaged_raw_files(tmp_path: Path) -> None:
    pytest.importorskip("rawpy")
    path = tmp_path / "p.dng"
    made.write_dng(path, mosaic(shaded()))
    whole = path.read_bytes()
    for part in np.linspace(0, 0.99, 50):
        path.write_bytes(whole[: int(len(whole) * part)])
        with pytest.raises(InputError, match=r"p\.dng") as raised:
            read_photo(path)
        assert "\n" not in str(raised.value)
    rng = np.random.default_rng(0)
    for _ in range(100):
        damaged = bytearray(whole)
        for place in rng.integers(4, 700, rng.integers(1, 6)):
            damaged[place] = rng.integers(0, 256)
        path.write_bytes(bytes(damaged))
        try:
            photo = read_photo(path)
        except InputError as error:
            assert "\n" not in str(error)
        else:
            assert photo.radiance.shape[:2] == image_size(path)[::-1]


def test_missing_rawpy_is_reported(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    path = tmp_path / "p.cr2"
    path.write_bytes(made.tiff_bytes({}))
    monkeypatch.setitem(sys.modules, "rawpy", None)
    for reader in (read_photo, image_size):
        with pytest.raises(InputError, match="linear 16-bit TIFF"):
            reader(path)
    with pytest.raises(InputError, match="no such file"):
        read_photo(tmp_path / "x.nef")
