"""Kinds of material on one surface are separated without masks."""

from __future__ import annotations

import json
from dataclasses import replace

import numpy as np
import pytest

from patina.commands import command_line
from patina.commands.fit import write_results
from patina.commands.progress import Progress
from patina.core.capture import read_capture
from patina.core.inputs.separated_materials import (
    can_separate,
    separated_names,
    with_separated,
    without_separated,
)
from patina.core.jobs import FitJob, finished
from patina.core.jobs.select_photos import select_photos
from patina.core.result import read_result
from patina.core.varying.separation import divide, second_at
from tests import make_capture as made
from tests.core.test_varying_job import fit_of_sixteen, held_out_errors

AXIS = np.array([0.6, 0.0, 0.8])  # of the half that is metal


def values(ratio, gloss):
    """Features of nodes of which the specular part alone changes the ratio."""
    return np.stack([ratio, gloss, ratio], axis=1)


def test_one_kind_is_not_divided():
    rng = np.random.default_rng(0)
    for one in (rng.normal(size=5000), rng.uniform(-2, 2, 5000), rng.exponential(size=5000)):
        assert divide(values(one, 0.3 * rng.normal(size=5000)), 5000) is None


@pytest.mark.parametrize("feature", [0, 1])
def test_two_groups_are_divided_between_their_means(feature):
    rng = np.random.default_rng(1)
    kind = rng.random(5000) < 0.2
    groups = np.where(kind, 2.0, -1.0) + 0.4 * rng.normal(size=5000)
    each = values(*[groups, 0.05 * rng.normal(size=5000)][:: 1 - 2 * feature])
    found = divide(each, 5000)
    assert found.feature == feature
    assert np.mean(found.second(each) == kind) > 0.99


def test_a_few_nodes_are_no_kind():
    ratio = np.concatenate([np.zeros(4900), np.full(100, 5.0)])
    ratio += 0.1 * np.random.default_rng(3).normal(size=5000)
    assert divide(values(ratio, np.zeros(5000)), 5000) is None


def test_two_colours_of_one_paint_are_no_kinds():
    rng = np.random.default_rng(6)
    colour = np.where(rng.random(5000) < 0.4, 1.0, -0.6) + 0.2 * rng.normal(size=5000)
    none = 0.1 * rng.normal(size=(5000, 2))
    assert divide(np.stack([-colour, *none.T], axis=1), 5000) is None


def test_differences_that_cannot_be_seen_are_no_kinds():
    rng = np.random.default_rng(4)
    ratio = np.where(rng.random(5000) < 0.5, 0.0, 0.1) + 0.01 * rng.normal(size=5000)
    assert divide(values(ratio, np.zeros(5000)), 5000) is None


def test_places_are_of_the_kind_of_most_neighbours():
    points = np.random.default_rng(5).random((4000, 3))
    second = points[:, 0] > 0.5
    second[::20] = ~second[::20]
    away = np.abs(points[:, 0] - 0.5) > 0.1
    assert np.mean(second_at(points[away], points, second) == (points[away, 0] > 0.5)) > 0.999


def half_metal(normal, light, view):
    """A Blinn–Phong metal on one half, a matt red paint on the other, 1/sr."""
    half = light + view
    half = half / np.linalg.norm(half, axis=-1, keepdims=True)
    lobe = np.clip(np.sum(normal * half, axis=-1), 0, 1)[..., None] ** 40
    metal = lobe * np.array([1.9, 1.5, 1.1]) + 0.004
    paint = np.array([0.14, 0.05, 0.04]) + 0.02 * lobe
    return np.where(metallic(normal)[..., None], metal, paint)


def metallic(normal):
    return normal @ AXIS > 0.1


@pytest.fixture(scope="module")
def halves(tmp_path_factory):
    return fit_of_sixteen(tmp_path_factory.mktemp("halves"), half_metal, portable=True)


@pytest.mark.slow
def test_metal_and_paint_are_separated(halves):
    capture, job = halves
    result = finished(job.result)
    assert [m.name for m in result.materials] == ["surface_1", "surface_2"]
    assert result.varying.separated_from == "surface"
    assert any("separated into 2 materials" in note for note in result.notes)
    mesh = result.scan.mesh
    normal = mesh.vertices[mesh.faces].mean(axis=1) - made.CENTRE
    true = metallic(normal / np.linalg.norm(normal, axis=1, keepdims=True))
    shown = np.isin(mesh.faces, np.flatnonzero(result.varying.photos[: len(mesh.vertices)] > 3))
    shown = shown.all(axis=1)
    agree = np.mean((result.face_material == 1) == true, where=shown)
    assert max(agree, 1 - agree) > 0.95
    one = FitJob(select_photos(capture, range(16)), portable=False)
    one.drain()
    even = held_out_errors(capture, finished(one.result), 16)
    separated = held_out_errors(capture, result, 16)
    assert separated.typical < 0.4 * even.typical
    assert separated.encoded_rmse < 0.5 * even.encoded_rmse


@pytest.mark.slow
def test_separated_materials_are_written_and_used_again(halves, tmp_path, monkeypatch):
    monkeypatch.setattr("patina.commands.fit.has_blender", lambda: False)
    capture, job = halves
    out, predicted = tmp_path / "out", tmp_path / "predicted"
    out.mkdir()
    write_results(out, out, finished(job.result), job.stages, Progress())
    assert (out / "surface_1.binary").is_file() and (out / "surface_2.binary").is_file()
    stored = read_result(out)
    assert stored.separated_from == "surface"
    assert [m.name for m in stored.materials] == ["surface_1", "surface_2"]
    assert command_line.main(["predict", str(capture.file), str(out), "--out", str(predicted)]) == 0
    errors = json.loads((predicted / "errors.json").read_text("utf-8"))
    assert errors["fitted"]["typical"] < 0.1


def test_separated_capture_becomes_the_one_before(tmp_path):
    capture = read_capture(made.make_capture(tmp_path, photos=3))
    separated = with_separated(capture, ("one", "two"))
    assert [m.name for m in separated.materials] == ["one", "two"]
    assert without_separated(separated, capture) == capture


def test_mask_of_the_only_material_becomes_that_of_all_parts(tmp_path):
    capture = read_capture(made.make_capture(tmp_path, photos=3))
    assert can_separate(capture)
    mask, out = tmp_path / "mask.png", tmp_path / "out.png"
    masked = [replace(p, masks={"surface": mask, "exclude": out}) for p in capture.photos]
    everywhere = replace(capture, photos=tuple(masked))
    assert can_separate(everywhere)
    parts = with_separated(everywhere, separated_names("surface", 2))
    assert [m.name for m in parts.materials] == ["surface_1", "surface_2"]
    for photo in parts.photos:
        assert photo.masks == {"exclude": out, "surface_1": mask, "surface_2": mask}
    assert not can_separate(replace(capture, photos=(masked[0], *capture.photos[1:])))
    assert not can_separate(parts)
