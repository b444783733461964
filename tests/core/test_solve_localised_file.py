"""The file of localised cameras: what is written is read back to the last bit; errors take one
line.
"""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np
import pytest
from hypothesis import HealthCheck, example, given, settings
from hypothesis import strategies as st

from patina.core.errors import InputError
from patina.core.scan.formats import read_reconstruction
from patina.core.scan.readers.patina_cameras import read_patina_cameras


def entry(**changed):
    good = {
        "label": "lit_0.jpg",
        "width": 640,
        "height": 480,
        "model": "SIMPLE_RADIAL",
        "parameters": [700.0, 320.5, 239.25, -0.1],
        "rotation": [[0.0, -1.0, 0.0], [1.0, 0.0, 0.0], [0.0, 0.0, 1.0]],
        "translation": [0.25, -1.0, 3.0],
        "photo": "lit_0.jpg",
        "inliers": 200,
    }
    return {**good, **changed}


def write(path: Path, *entries, **top) -> Path:
    data = {"patina_cameras": 1, "frame": "mesh", "cameras": list(entries), **top}
    path.write_text(json.dumps(data), "utf-8")
    return path


def test_point_projects_as_computed_by_hand(tmp_path: Path) -> None:
    found = read_reconstruction(write(tmp_path / "localised.cameras.json", entry()))
    (camera,) = found.cameras
    # by hand: x_cam = (−y, x, z) + t; r² of (u, v) = (x/z, y/z); u' = u (1 + k r²)
    point = np.array([1.5, 0.5, 1.0])
    u, v = (-0.5 + 0.25) / 4.0, (1.5 - 1.0) / 4.0
    bend = 1 - 0.1 * (u * u + v * v)
    expected = (700 * u * bend + 320.5, 700 * v * bend + 239.25)
    assert np.allclose(camera.project(point[None])[0], expected, atol=1e-9)
    assert (camera.label, camera.photo) == ("lit_0.jpg", "lit_0.jpg")


@pytest.mark.parametrize(
    ("change", "message"),
    [
        ({"label": 7}, "cameras 1.label"),
        ({"width": 0}, "cameras 1.width"),
        ({"width": True}, "cameras 1.width"),
        ({"model": "SPHERICAL"}, "cameras 1.model"),
        ({"model": None}, "cameras 1.model"),
        ({"model": "METASHAPE_FRAME"}, "cameras 1.model"),
        ({"parameters": [700.0]}, "cameras 1.model"),
        ({"parameters": "700"}, "cameras 1.parameters"),
        ({"parameters": [700.0, 320.5, 239.25, float("nan")]}, "cameras 1.parameters"),
        ({"parameters": [[[1.0]]]}, "cameras 1.parameters"),
        ({"parameters": [0.0, 320.0, 240.0, 0.0]}, "focal length"),
        ({"rotation": [[1, 0, 0], [0, 1, 0], [0, 0, -1]]}, "cameras 1.rotation"),
        ({"rotation": [[2, 0, 0], [0, 2, 0], [0, 0, 2]]}, "cameras 1.rotation"),
        ({"rotation": [[1, 0], [0, 1]]}, "cameras 1.rotation"),
        ({"translation": [1e400, 0, 0]}, "cameras 1.translation"),
        ({"translation": [True, 0, 0]}, "cameras 1.translation"),
        ({"photo": 3}, "cameras 1.photo"),
    ],
)
def test_invalid_entry_is_named(tmp_path: Path, change: dict, message: str) -> None:
    path = write(tmp_path / "x.json", entry(**change))
    with pytest.raises(InputError, match=message) as error:
        read_patina_cameras(path)
    assert "\n" not in str(error.value) and str(path) in str(error.value)


def test_other_files_are_rejected_with_message(tmp_path: Path) -> None:
    path = tmp_path / "x.json"
    cases = (
        write(path, entry(), entry()).read_text(),
        write(path).read_text(),
        write(path, entry(), frame="elsewhere").read_text(),
        write(path, entry(), patina_cameras=2).read_text(),
        "[]",
        "{}",
        "",
        '{"patina_cameras": 1, "frame": "mesh", "cameras": 3}',
    )
    for text in cases:
        path.write_text(text)
        with pytest.raises(InputError):
            read_patina_cameras(path)


@settings(
    max_examples=150, deadline=2000, suppress_health_check=[HealthCheck.function_scoped_fixture]
)
@given(st.integers(0, 10_000), st.binary(max_size=12))
@example(0, b"")
@example(30, b"\xff\xfe")
@example(200, b"[[[[[[")
@example(300, b"1e999")
def test_fuzz_read_patina_cameras(tmp_path: Path, place: int, bytes_: bytes) -> None:
    """A few bytes changed anywhere in a valid file: cameras, or a one-line error."""
    path = write(tmp_path / "x.json", entry(), entry(label="b"))
    good = path.read_bytes()
    place %= len(good)
    path.write_bytes(good[:place] + bytes_ + good[place + len(bytes_) :])
    try:
        found = read_patina_cameras(path)
    except InputError as error:
        assert "\n" not in str(error)
        return
    for camera in found.cameras:
        assert np.isfinite(camera.parameters).all() and np.isfinite(camera.pose.centre).all()
