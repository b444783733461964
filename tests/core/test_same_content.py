"""A photo that is a copy of another is mentioned: held-out errors are too small."""

from __future__ import annotations

import shutil
from dataclasses import replace
from pathlib import Path

from patina.core.capture import read_capture
from patina.core.inputs.photos import LitPhotos

DEMO = Path(__file__).parents[2] / "assets" / "demo" / "demo.capture.toml"


def with_second(path: Path):
    """The demo with another file as its second photo."""
    capture = read_capture(DEMO)
    first, second, *others = capture.photos
    return first.file, replace(capture, photos=(first, replace(second, files=(path,)), *others))


def test_a_copy_of_a_photo_is_mentioned(tmp_path):
    copy = tmp_path / "renamed.jpg"
    first, capture = with_second(copy)
    shutil.copy(first, copy)
    notes = " ".join(LitPhotos.open(capture).notes)
    assert f"Copies of other photos: renamed.jpg of {first.name}." in notes


def test_photos_of_one_size_with_other_pixels_are_accepted(tmp_path):
    other = tmp_path / "other.jpg"
    first, capture = with_second(other)
    content = bytearray(first.read_bytes())
    content[len(content) // 3] ^= 1  # outside the parts that are compared first
    other.write_bytes(content)
    assert "Copies" not in " ".join(LitPhotos.open(capture).notes)
