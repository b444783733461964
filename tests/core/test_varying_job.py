"""A painted sphere: what varies is found, written, read back, and used in predictions."""

from __future__ import annotations

import json

import numpy as np
import OpenImageIO as oiio
import pytest

import patina
from patina.commands import command_line
from patina.core.capture import read_capture
from patina.core.concurrency.steps import drained
from patina.core.errors import InputError
from patina.core.jobs import FitJob, finished
from patina.core.jobs.photo_prediction import predict_one, prediction_inputs
from patina.core.jobs.select_photos import select_photos
from patina.core.jobs.varying.node_steps import CHOICE_NODES
from patina.core.jobs.varying.surface_observations import observe_surface
from patina.core.jobs.varying.variation_for_diagnosis import variation_for_diagnosis
from patina.core.jobs.varying.varying_job import VaryingJob
from patina.core.predict.errors import PhotoErrors
from patina.core.result import read_result
from patina.core.scan.mesh import read_mesh
from patina.core.scan.mesh_formats.write_ply import write_ply
from patina.core.varying.node_model import DIFFUSE, NodeModel
from patina.core.varying.rough_lobe import rough_lobe_variance
from tests import make_capture as made
from tests import make_result

DIFFUSE_BRDF = np.array([0.16, 0.05, 0.04])  # 1/sr, of the material that make_capture uses
NODES = 20_000


def paint(normal):
    """Factor (n, 3) of the diffuse colour: bands around three axes."""
    return 1 + 0.45 * np.sin(5 * normal)


def painted(normal, light, view):
    return made.blinn(normal, light, view) + DIFFUSE_BRDF * (paint(normal) - 1)


def held_out_errors(capture, fitted, place):
    given = prediction_inputs(capture, fitted)
    return drained(predict_one(given, place)).errors


def known_variation(fitted):
    """The variation that a diagnosis starts from."""
    surface = drained(observe_surface(fitted, CHOICE_NODES, 0.0, 0.1))
    return drained(variation_for_diagnosis(fitted, surface, 0.1, 0.9))


def fit_of_sixteen(folder, brdf, portable=False):
    """(capture of 17 photos of a sphere, the job of a fit of the first 16)."""
    capture = read_capture(made.make_capture(folder, photos=17, brdf=brdf))
    job = VaryingJob(FitJob(select_photos(capture, range(16)), portable=portable), nodes=NODES)
    job.drain()
    return capture, job


@pytest.fixture(scope="module")
def banded(tmp_path_factory):
    return fit_of_sixteen(tmp_path_factory.mktemp("banded"), painted)


@pytest.mark.slow
def test_painted_sphere_varies_and_a_photo_is_predicted_better(banded):
    capture, job = banded
    result = finished(job.result)
    kind = result.varying.materials[0]
    assert kind.kind != "even"
    assert kind.typical[kind.kind] < 0.5 * kind.typical["even"]
    assert any("varies over the surface" in note for note in result.notes)
    even = held_out_errors(capture, finished(job.fit.result), 16)
    varied = held_out_errors(capture, result, 16)
    assert isinstance(varied, PhotoErrors)
    assert varied.encoded_rmse < 0.6 * even.encoded_rmse
    assert varied.typical < 0.6 * even.typical


@pytest.mark.slow
def test_colour_of_nodes_is_that_of_the_paint(banded):
    _, job = banded
    surface = finished(job.result).varying
    normal = surface.grid.points(slice(None)) - made.CENTRE
    normal /= np.linalg.norm(normal, axis=1, keepdims=True)
    seen = surface.photos >= 3
    assert seen.mean() > 0.3
    error = surface.parameters[seen][:, DIFFUSE] - np.log(paint(normal[seen]))
    error -= np.median(error, axis=0)  # the level belongs to the BRDF
    spread = np.log(paint(normal[seen])).std(axis=0)
    assert np.all(np.median(np.abs(error), axis=0) < 0.25 * spread)
    variance = np.square(surface.deviation[seen])
    assert np.mean(np.abs(error) < 1.645 * np.sqrt(variance[:, DIFFUSE])) > 0.9
    # of the sphere, every place has the same lobe, and the standard errors hold without its share
    material = finished(job.result).materials[0]
    model = NodeModel.of(material.fit.brdf, material.scale)
    variance -= rough_lobe_variance(model, surface.parameters[seen])
    within = np.abs(error) < 1.645 * np.sqrt(variance[:, DIFFUSE])
    assert within.mean() > 0.8


@pytest.mark.slow
def test_slow_variation_is_left_to_the_patches(banded):
    """A wrong light or a veil looks like that too."""
    _, job = banded
    assert known_variation(finished(job.fit.result)) is None


@pytest.mark.slow
def test_even_sphere_keeps_its_material(tmp_path):
    capture = read_capture(made.make_capture(tmp_path, photos=8))
    job = VaryingJob(FitJob(capture, portable=False), nodes=NODES)
    job.drain()
    result, before = finished(job.result), finished(job.fit.result)
    assert result.varying is None
    assert result.materials == before.materials
    assert any("is even" in note for note in result.notes)
    assert known_variation(before) is None


@pytest.mark.slow
@pytest.mark.usefixtures("simple_portable")
def test_fit_writes_the_variation_and_predict_uses_it(tmp_path, monkeypatch):
    monkeypatch.setattr("patina.commands.fit.has_blender", lambda: False)
    capture = str(made.make_capture(tmp_path, photos=8, brdf=painted))

    def run(*words: str) -> int:
        return command_line.main([*words])

    errors = []
    for mode in ("never", "auto"):
        result, out = str(tmp_path / mode), tmp_path / f"predicted_{mode}"
        assert run("fit", capture, "--out", result, "--varying", mode) == 0
        assert run("predict", capture, result, "--out", str(out)) == 0
        errors.append(json.loads((out / "errors.json").read_text("utf-8"))["fitted"])
    assert not (tmp_path / "never" / "varying.npz").exists()
    described = json.loads((tmp_path / "auto" / "result.json").read_text("utf-8"))["varying"]
    assert described["file"] == "varying.npz" and described["materials"][0]["varies"] != "even"
    assert errors[1]["encoded_rmse"] < 0.6 * errors[0]["encoded_rmse"]
    pages = [tmp_path / mode / "report" / "index.html" for mode in ("never", "auto")]
    even, varied = (page.read_text("utf-8") for page in pages)
    assert "What varies" in varied and "What varies" not in even
    typical = described["materials"][0]["held_out_typical"][described["materials"][0]["varies"]]
    assert f"<span class='big'>{100 * typical:.1f} %</span>" in varied
    file = str(pages[1].parent / "varies_0_colour.png")
    colour = oiio.ImageBuf(file).get_pixels(oiio.FLOAT)[..., :3] * 255
    shown = np.ptp(colour, axis=-1) > 20  # the background is grey
    assert shown.sum() > 500
    ratio = np.log(colour[shown][:, 0] + 1) - np.log(colour[shown][:, 1] + 1)
    assert ratio.std() > 0.1  # the bands
    with pytest.raises(InputError, match="expected one of auto, never, always"):
        patina.fit(patina.load_capture(capture), varying="sometimes")
    (tmp_path / "auto" / "varying.npz").unlink()
    assert run("predict", capture, str(tmp_path / "auto"), "--out", str(tmp_path / "p")) != 0


@pytest.mark.slow
@pytest.mark.usefixtures("simple_portable")
def test_library_exports_the_variation(tmp_path, monkeypatch):
    monkeypatch.setattr("patina.commands.maps.has_blender", lambda: False)
    file = made.make_capture(tmp_path, photos=8, brdf=painted)
    vertices, faces = made.sphere_mesh()
    turn = np.arctan2(*(vertices - made.CENTRE).T[:2]) / (2 * np.pi) + 0.5
    uv = np.stack([turn, 0.5 + 0.4 * (vertices - made.CENTRE)[:, 2]], axis=1)
    write_ply(tmp_path / "mesh.ply", vertices, faces, uv[faces])
    capture = patina.load_capture(file)
    found = patina.fit(capture, varying="always")
    assert found.details.varying.varies
    out = tmp_path / "out"
    patina.export(found, out, ["json"])
    assert (out / "varying.npz").is_file()
    assert read_result(out).varying == out / "varying.npz"
    words = ["maps", str(file), str(out), "--out", str(tmp_path / "maps"), "--size", "64"]
    assert command_line.main([*words, "--displaced"]) == 0
    relief = read_mesh(tmp_path / "maps" / "displaced.ply")
    assert len(relief.faces) > 4 * len(faces)
    radius = np.linalg.norm(relief.vertices - made.CENTRE, axis=1)
    assert np.abs(radius - 1).max() < 0.05  # of a sphere without relief


def test_relief_of_even_materials_is_refused(tmp_path, capsys):
    file = made.make_capture(tmp_path, photos=1)
    content = make_result.description(make_result.material("surface", make_result.BRONZE))
    result = make_result.write_result(tmp_path / "result", content)
    words = ["maps", str(file), str(result), "--out", str(tmp_path / "maps"), "--displaced"]
    assert command_line.main(words) == 2
    assert "so there is no relief" in capsys.readouterr().err
