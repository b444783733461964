"""The second demo: small, complete, and on the scan of the first."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np
import pytest

from patina.core.capture import read_capture
from patina.core.concurrency.steps import drained
from patina.core.inputs import capture_data
from patina.core.inputs.photos import LitPhotos
from patina.core.jobs import FitJob
from patina.core.jobs.varying.node_steps import CHOICE_NODES, model_of
from patina.core.jobs.varying.surface_observations import observe_surface
from patina.core.varying.node_model import diffuse_factor
from patina.core.varying.varying_surface import ALL_VARIATIONS
from tools.demo_worn import DOT_RADIUS, dot_distance

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


@pytest.mark.slow
def test_small_dots_keep_their_hue() -> None:
    """The blue dots are a hundredth of a red surface, and one or two photos show each: they must
    not get the hue that the rest varies by."""
    fit = FitJob(read_capture(FOLDER / "worn.capture.toml"), portable=False)
    fit.drain()
    surface = drained(observe_surface(fit.result, CHOICE_NODES, 0.0, 1.0))
    material = fit.result.materials[0]
    seen, nodes = surface.of_material(0, material, CHOICE_NODES)
    model = model_of(material)
    parameters = nodes.estimate(model, seen, ALL_VARIATIONS)
    truth = json.loads((FOLDER.parent / "demo" / "truth.json").read_text("utf-8"))
    in_object = nodes.points @ np.array(truth["scan_from_object"])
    inside = dot_distance(in_object) < 0.6 * DOT_RADIUS
    shown = np.isin(np.arange(len(nodes.points)), seen.node)
    colour = np.median(model.body * diffuse_factor(parameters[inside & shown]), axis=0)
    assert np.count_nonzero(inside & shown) > 50
    assert colour[2] > 2.0 * colour[0] and colour[2] > 0.75 * colour[1]  # true: 7.9, 1.5
