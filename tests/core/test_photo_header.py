"""Image sizes come from headers, whole files are checked once, and a changed file is read again."""

from __future__ import annotations

import os
import struct
import time
from pathlib import Path

import numpy as np
import pytest

from patina.core.errors import InputError
from patina.core.photo import image_size, read_encoded, read_exif
from patina.core.photo.image import write_exr
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


LARGE = 1 << 26  # bytes of a value: more than any photo has


def test_values_that_no_photo_has_are_refused_before_a_library_reads_them(tmp_path: Path) -> None:
    path = tmp_path / "a.exr"
    write_exr(path, np.ones((8, 8, 3), np.float32))
    content = path.read_bytes()
    for size, refused in ((1 << 20, False), (LARGE, True)):
        attribute = b"notes\0string\0" + size.to_bytes(4, "little") + bytes(size)
        path.write_bytes(content[:8] + attribute + content[8:])
        if refused:
            with pytest.raises(InputError, match=r"declares the attribute 'notes' of 67\.1 MB"):
                read_encoded(path)
        else:
            assert read_encoded(path).max() == 1.0
    path.write_bytes(content[:60])
    with pytest.raises(InputError, match="EXR header"):
        read_encoded(path)


@pytest.mark.parametrize(("tag", "refused"), [(34675, True), (700, True), (37724, False)])
def test_large_values_of_a_tiff(tmp_path: Path, tag: int, refused: bool) -> None:
    path = tmp_path / "a.tif"
    entries = [(256, 4, 8), (257, 4, 8), (258, 3, 8), (259, 3, 1), (262, 3, 1), (273, 4, 512),
               (277, 3, 1), (278, 4, 8), (279, 4, 64)]  # fmt: skip
    head = b"II*\0" + (8).to_bytes(4, "little") + (len(entries) + 1).to_bytes(2, "little")
    for number, kind, value in entries:
        head += struct.pack("<HHII", number, kind, 1, value)
    head += struct.pack("<HHIII", tag, 7, LARGE, 1024, 0)
    with path.open("wb") as file:
        file.write(head.ljust(1024, b"\x80"))
        file.truncate(1024 + LARGE)
    if refused:
        with pytest.raises(InputError, match=r"declares .* of 67\.1 MB; expected at most 32 MB"):
            read_encoded(path)
    else:  # layers of Photoshop
        assert read_encoded(path).shape == (8, 8, 3)


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
