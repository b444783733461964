"""Image sizes come from headers, whole files are checked once, and a changed file is read again."""

from __future__ import annotations

import os
import time
from pathlib import Path

import numpy as np
import pytest

from patina.core.errors import InputError
from patina.core.photo import image_size, read_encoded, read_exif
from patina.core.photo.per_file import once_per_file
from tests import make_photos as made

LONG_AGO = time.time() - 3600


def noise(height: int = 300, width: int = 400) -> np.ndarray:
    return np.random.default_rng(1).integers(0, 256, (height, width, 3), np.uint8)


@pytest.mark.parametrize("name", ["a.png", "a.jpg"])
def test_size_needs_no_pixels(tmp_path: Path, name: str) -> None:
    path = tmp_path / name
    exif = made.tiff_bytes({}, exif={0x829A: made.rationals((1, 50))})
    if name == "a.png":
        made.write_png(path, noise(), [(b"eXIf", exif)])
    else:
        made.write_jpeg(path, noise(), (made.app1_exif(exif),), quality=90)
    os.truncate(path, path.stat().st_size // 2)
    assert image_size(path) == (400, 300)
    assert read_exif(path).exposure_time == 1 / 50
    with pytest.raises(InputError, match="is truncated"):
        read_encoded(path)


def test_a_file_is_read_again_only_after_a_change(tmp_path: Path) -> None:
    path, reads = tmp_path / "a", []

    @once_per_file
    def content(path: Path) -> bytes:
        reads.append(path)
        return path.read_bytes()

    path.write_bytes(b"1")
    assert [content(path), content(path)] == [b"1", b"1"]
    assert len(reads) == 2  # too recent: a second change could have the same modification time
    os.utime(path, (LONG_AGO, LONG_AGO))
    assert [content(path), content(path)] == [b"1", b"1"]
    assert len(reads) == 3
    path.write_bytes(b"2")
    os.utime(path, (LONG_AGO + 1, LONG_AGO + 1))
    assert content(path) == b"2"
    path.unlink()
    with pytest.raises(FileNotFoundError):
        content(path)


def test_later_damage_of_valid_file_is_detected(tmp_path: Path) -> None:
    path = tmp_path / "a.png"
    made.write_png(path, noise())
    os.utime(path, (LONG_AGO, LONG_AGO))
    whole = read_encoded(path)
    assert np.array_equal(read_encoded(path), whole)
    os.truncate(path, path.stat().st_size - 30)
    with pytest.raises(InputError, match="is truncated"):
        read_encoded(path)
