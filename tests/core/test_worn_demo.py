"""The second demo: small, complete, and on the scan of the first."""

from __future__ import annotations

from pathlib import Path

from patina.core.capture import read_capture
from patina.core.inputs import capture_data
from patina.core.inputs.photos import LitPhotos

FOLDER = Path(__file__).parents[2] / "assets" / "worn"


def test_folder_is_small_and_complete() -> None:
    files = [path for path in FOLDER.rglob("*") if path.is_file()]
    capture = read_capture(FOLDER / "worn.capture.toml")
    photos = {photo.file.resolve() for photo in capture.photos}
    assert {path.resolve() for path in files if path.suffix == ".jpg"} == photos
    assert sum(path.stat().st_size for path in files) < 1.5e6


def test_photos_fit_the_scan() -> None:
    capture = read_capture(FOLDER / "worn.capture.toml")
    scan = capture_data.open_scan(capture)
    capture_data.check_photos(capture, scan)
    photos = LitPhotos.open(capture)
    lit = photos.read(0)
    assert 0.05 < (lit.radiance.max(axis=-1) > 0.05).mean() < 0.8
    assert [
        len([p for p in capture.photos if p.light == light.name]) for light in capture.lights
    ] == [4] * 6
