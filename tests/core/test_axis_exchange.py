"""A mesh whose axes were exchanged by an export is recognised, and the right axes are named."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from patina.core.capture import read_capture
from patina.core.errors import InputError
from patina.core.geometry import RayScene
from patina.core.inputs import capture_data
from patina.core.inputs.lights import find_lights
from patina.core.inputs.photos import LitPhotos
from patina.core.jobs import FitJob
from patina.core.jobs.axis_exchange import better_axes
from patina.core.scan import Scan

DEMO = Path(__file__).parents[2] / "assets" / "demo" / "demo.capture.toml"


def y_up(scan: Scan) -> Scan:
    """The scan with its mesh as an export with y up writes it: (x, y, z) → (x, z, -y)."""
    x, y, z = np.asarray(scan.mesh.vertices).T
    return replace(scan, mesh=replace(scan.mesh, vertices=np.stack([x, z, -y], axis=1)))


def opened():
    """The demo's capture, scan, photos and lights."""
    capture = read_capture(DEMO)
    scan = capture_data.open_scan(capture)
    photos = LitPhotos.open(capture)
    return capture, scan, photos, find_lights(capture, scan, photos)


def test_the_right_axes_are_named():
    capture, scan, photos, lights = opened()
    mesh = y_up(scan).mesh
    text = better_axes(capture, scan, RayScene.build(mesh), photos, lights)
    assert "(x, y, z) → (x, -z, y)" in text and "z up, not y up" in text


def test_the_error_names_them_where_nothing_can_be_fitted(shared):
    bunny = shared / "data" / "scans" / "bunny_red" / "scan.capture.toml"
    job = FitJob(read_capture(bunny), prepare=y_up, portable=False)
    with pytest.raises(InputError, match=r"\(x, y, z\) → \(x, -z, y\)") as raised:
        job.drain()
    assert raised.value.file is not None


def test_right_axes_and_other_errors_propose_nothing():
    capture, scan, photos, lights = opened()
    assert better_axes(capture, scan, RayScene.build(scan.mesh), photos, lights) == ""
    size = scan.mesh.size
    offset = np.array([0.2 * size, 0.0, 0.0])
    moved = replace(scan.mesh, vertices=np.asarray(scan.mesh.vertices) + offset)
    assert better_axes(capture, scan, RayScene.build(moved), photos, lights) == ""
