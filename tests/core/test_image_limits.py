"""Images that declare more pixels than any photo are refused before they are decoded, and masks
need little memory."""

from __future__ import annotations

import time
import tracemalloc

import numpy as np
import OpenImageIO as oiio
import pytest

from patina.core.errors import InputError
from patina.core.photo import read_mask
from patina.core.photo.container import LIMIT_VARIABLE
from patina.core.photo.image import image_size, read_encoded


def write(path, pixels):
    spec = oiio.ImageSpec(pixels.shape[1], pixels.shape[0], pixels.shape[2], str(pixels.dtype))
    out = oiio.ImageOutput.create(str(path))
    out.open(str(path), spec)
    out.write_image(np.ascontiguousarray(pixels))
    out.close()
    return path


@pytest.mark.parametrize("read", [read_encoded, read_mask, image_size])
def test_bomb_is_refused_at_once(tmp_path, read):
    path = write(tmp_path / "bomb.png", np.zeros((17_000, 17_000, 1), np.uint8))
    assert path.stat().st_size < 1_000_000
    since = time.perf_counter()
    with pytest.raises(InputError, match=r"17000 × 17000 pixels.*270 million in total"):
        read(path)
    assert time.perf_counter() - since < 2


def test_limit_is_a_setting(tmp_path, monkeypatch):
    path = write(tmp_path / "small.png", np.zeros((1100, 1000, 3), np.uint8))
    monkeypatch.setenv(LIMIT_VARIABLE, "1")
    with pytest.raises(InputError, match="1 million in total"):
        read_encoded(path)
    monkeypatch.setenv(LIMIT_VARIABLE, "many")
    with pytest.raises(InputError, match="found 'many'"):
        read_encoded(path)
    monkeypatch.setenv(LIMIT_VARIABLE, "2")
    assert read_encoded(path).shape == (1100, 1000, 3)


@pytest.mark.parametrize(("kind", "channels"), [
    *((kind, channels) for kind in (np.uint8, np.uint16) for channels in (1, 2, 3, 4)),
    (np.float32, 1), (np.float32, 3), (np.float32, 4),
])  # fmt: skip
def test_mask_is_white_and_opaque(tmp_path, kind, channels):
    top = 1.0 if kind is np.float32 else np.iinfo(kind).max
    path = tmp_path / ("mask.exr" if kind is np.float32 else "mask.png")
    rng = np.random.default_rng(0)
    white = rng.random((600, 40)) > 0.5
    pixels = np.where(white[..., None], 0.8 * top, 0.2 * top).repeat(channels, axis=2)
    if channels in (2, 4):
        opaque = rng.random(white.shape) > 0.3
        pixels[..., -1] = np.where(opaque, top, 0)
        white &= opaque
    write(path, pixels.astype(kind))
    assert (read_mask(path) == white).all()


def test_memory_of_a_mask_is_that_of_its_result(tmp_path):
    path = write(tmp_path / "mask.png", np.full((3000, 3000, 4), 255, np.uint8))
    tracemalloc.start()
    read_mask(path)
    _, peak = tracemalloc.get_traced_memory()
    tracemalloc.stop()
    assert peak < 40_000_000  # all channels as numbers would be 144 MB
