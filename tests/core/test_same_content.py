"""A photo that is a copy of another is mentioned: held-out errors are too small."""

from __future__ import annotations

import shutil
from dataclasses import replace
from pathlib import Path

from patina.core.capture import read_capture
from patina.core.inputs.photos import LitPhotos
from patina.core.inputs.same_content import PART_BYTES

DEMO = Path(__file__).parents[2] / "assets" / "demo" / "demo.capture.toml"


def with_second(path: Path):
    """The demo with another file as its second photo."""
    capture = read_capture(DEMO)
    first, second, *others = capture.photos
    return first.file, replace(capture, photos=(first, replace(second, files=(path,)), *others))


def test_a_copy_of_a_photo_is_mentioned(tmp_path):
    copy = tmp_path / "renamed.exr"
    first, capture = with_second(copy)
    shutil.copy(first, copy)
    notes = " ".join(LitPhotos.open(capture).notes)
    shown = first.relative_to(DEMO.parent).as_posix()
    assert f"same content as others: {copy.as_posix()} of {shown}." in notes


def test_photos_of_one_size_with_other_pixels_are_accepted(tmp_path):
    other = tmp_path / "other.exr"
    first, capture = with_second(other)
    content = bytearray(first.read_bytes())
    assert len(content) > 2 * PART_BYTES
    content[len(content) // 3] ^= 1  # outside the parts that are compared first
    other.write_bytes(content)
    assert "same content" not in " ".join(LitPhotos.open(capture).notes)
