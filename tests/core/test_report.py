"""Figures and images of the report, on a capture with a known answer."""

from __future__ import annotations

import json
import re
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from patina.core.brdf import TabulatedBRDF, metrics
from patina.core.capture import read_capture
from patina.core.jobs import CaptureResult, FitJob
from patina.core.jobs.fit_warnings import black_photo_warnings
from patina.core.photo import read_encoded
from patina.core.report import figures, result_json, write_report
from patina.core.views import display
from patina.core.views.sphere import lit_sphere
from tests import make_capture as made
from tests.sampled import sampled


@pytest.fixture(scope="module")
def job(tmp_path_factory: pytest.TempPathFactory) -> FitJob:
    path = made.make_capture(tmp_path_factory.mktemp("ball"), photos=3)
    job = FitJob(read_capture(path))
    job.drain()
    return job


@pytest.fixture(scope="module")
def result(job: FitJob) -> CaptureResult:
    assert job.result is not None
    return job.result


def test_page_contains_all_linked_images(result: CaptureResult, tmp_path: Path) -> None:
    fractions = list(write_report(tmp_path / "report", result))
    assert fractions == sorted(fractions) and len(fractions) == 4
    page = (tmp_path / "report" / "index.html").read_text()
    pictures = {p.name for p in (tmp_path / "report").glob("*.png")}
    assert len(pictures) == 4 * 3 + 3 + 2  # photos, spheres, slices
    assert all(f"src='{name}'" in page for name in pictures)
    assert "http" not in page.replace("http://www.w3.org/2000/svg", "")
    assert read_encoded(tmp_path / "report" / "photo_00_prediction.png").mean() > 0.05


def test_result_json_describes_measurement(result: CaptureResult, job: FitJob) -> None:
    description = json.loads(json.dumps(result_json.describe(result, job.stages)))
    material = description["materials"][0]
    assert material["estimator"] == "measured" and "chosen" not in material
    coefficients = np.array(material["coefficients"])
    assert coefficients.shape == (3, result.basis.count)
    samples = material["samples"]
    assert samples["used"] == samples["taken"] == sum(samples["per_photo"].values()) > 1000
    photos = {f"lit_{i}.exr" for i in (1, 2, 3)}
    assert set(material["held_out"]["per_photo"]) == photos >= set(material["gains"])
    assert 0 < material["normal_deviation"] < 3
    lobes, turning = material["lobe_stack"], material["turning_lobe_stack"]
    assert 1 <= len(lobes["lobes"]) <= 3 and lobes["lobes"][0].keys() >= {"f0", "f90", "roughness"}
    assert not any(key.endswith(("_mid", "_edge")) for key in (*lobes, *lobes["lobes"][0]))
    assert 0 < turning["cube_root_error"] < 0.3
    uncertainty = material["uncertainty"]
    for key, value in uncertainty["interval_90"].items():
        assert value == pytest.approx(np.exp(1.645 * uncertainty[key]) - 1, rel=1e-3) and value > 0
    assert {s["name"] for s in description["stages"]} >= {"reading the scan", "sampling the photos"}
    assert all(s["seconds"] >= 0 for s in description["stages"])
    assert description["basis"]["version"] == result.basis.version
    assert description["basis"]["components"] == result.basis.count


def test_paper_result_lists_selected_pixels(tmp_path: Path) -> None:
    path = made.make_capture(
        tmp_path / "ball", photos=3, extra='[fit]\nmethod = "paper"\ntrials = 2'
    )
    job = FitJob(read_capture(path))
    job.drain()
    assert job.result is not None
    description = json.loads(json.dumps(result_json.describe(job.result, job.stages)))
    material = description["materials"][0]
    assert material["estimator"] == "paper" and np.array(material["coefficients"]).shape == (3, 6)
    assert len(material["chosen"]) == 6 and len(material["cosine_similarity"]) == 2
    for selected in material["chosen"]:
        assert 0 <= selected["pixel"][0] < made.WIDTH and 0 <= selected["pixel"][1] < made.HEIGHT
    assert "interval_90" not in material["uncertainty"] and "gains" not in material
    list(write_report(tmp_path / "report", job.result))
    page = (tmp_path / "report" / "index.html").read_text()
    assert "6 selected" in page and "shaded" not in page
    assert "Rings: the pixels" in page and "too curved" in page


def test_page_shows_sources_of_samples(result: CaptureResult, tmp_path: Path) -> None:
    """A legend of the pixel criteria, and their share of the surface in each photo."""
    list(write_report(tmp_path / "report", result))
    page = (tmp_path / "report" / "index.html").read_text()
    counts = re.findall(r"<ul class='counts'>(.*?)</ul>", page)
    assert len(counts) == 3 and "Rings" not in page
    for place, share_list in enumerate(counts):
        percent = int(re.search(r"(\d+) % reliable", share_list).group(1))
        assert 20 < percent < 100
        reliable = result.materials[0].per_photo[place]
        others = sum(int(n) for n in re.findall(r"(\d+) %", share_list)) - percent
        assert reliable > 500 and percent + others == pytest.approx(100, abs=5)
    head = page[page.index("<details>") : page.index("</details>")]
    assert "in shadow: turned away" in head and "too curved" not in head and "clipped" not in head
    legend = set(re.findall(r"rgb\(\d+,\d+,\d+\)", head))
    assert legend == set(re.findall(r"rgb\(\d+,\d+,\d+\)", "".join(counts)))


def test_wide_intervals_are_written_as_factors() -> None:
    assert figures.either_side(0.05) == "± 9 %"  # exp(1.645 · 0.05) = 1.086
    assert figures.either_side(0.5) == "a factor of 2.3 either way"  # exp(1.645 · 0.5) = 2.28


def test_unused_samples_are_reported(result: CaptureResult) -> None:
    material = replace(result.materials[0], samples=2_500_000, used=400_001)
    shown = dict(figures.figures(material, ["a"] * 3))["Samples"]
    assert shown.startswith("2,500,000 lit pixels; 400,001 of them (16 %) are used")


def test_page_shows_uncertainty(result: CaptureResult, tmp_path: Path) -> None:
    list(write_report(tmp_path / "report", result))
    page = (tmp_path / "report" / "index.html").read_text()
    assert page.count("<polygon") == 12  # four charts, three channels
    assert "90 % interval" in page and "all of them used" in page


def test_difference_image_has_sign_of_difference() -> None:
    measured = np.ones((1, 3, 3))
    predicted = np.array([[[0.0] * 3, [1.0] * 3, [2.0] * 3]])
    dark, right, bright = display.difference_picture(predicted, measured, 1.0)[0].astype(int)
    assert dark[2] > dark[0] and bright[0] > bright[2] and abs(right[0] - right[2]) < 3


def test_white_sphere_has_lambertian_radiance() -> None:
    radiance, coverage = lit_sphere(lambda a: np.full((len(a.theta_h), 3), 1 / np.pi), 101)
    assert radiance.max() == pytest.approx(1.0, abs=0.02)
    assert coverage[50, 50] == 1 and coverage[0, 0] == 0


def test_metrics_of_known_differences() -> None:
    a = TabulatedBRDF.from_function(lambda x: np.full((len(x.theta_h), 3), 0.4))
    b = TabulatedBRDF.from_function(lambda x: np.full((len(x.theta_h), 3), 0.5))
    found = metrics.compare(a, b)
    assert found.relative_l2 == pytest.approx(0.2, rel=1e-5)
    assert found.log_relative_rms == pytest.approx(abs(np.log(0.8)), rel=0.02)
    same = metrics.compare(a, a)
    assert same.relative_l2 == same.log_relative_rms == same.cube_root_rms == 0


def test_swapped_photos_are_named_in_warning(tmp_path: Path) -> None:
    """The most common mistake: two photos are swapped."""
    path = made.make_capture(tmp_path / "ball", photos=6)
    text = path.read_text().replace("view_02", "swap").replace("view_05", "view_02")
    path.write_text(text.replace("swap", "view_05"))
    warnings = black_photo_warnings(sampled(path)[0], read_capture(path))
    assert len(warnings) == 1, "photos are merged into one sentence"
    assert "lit_2.exr" in warnings[0] or "lit_5.exr" in warnings[0], warnings


def test_wrong_light_is_the_first_warning(tmp_path: Path) -> None:
    path = made.make_capture(tmp_path / "ball", photos=3, extra="[fit]\nheld_out = false")
    capture = read_capture(path)
    turn = np.array([[0.0, -1, 0], [1, 0, 0], [0, 0, 1]])  # 90° about z
    lights = tuple(replace(light, direction=turn @ light.direction) for light in capture.lights)
    job = FitJob(replace(capture, lights=lights))
    job.drain()
    assert "black where the light should reach" in job.result.materials[0].warnings[0]


def test_good_capture_has_no_swap_warning(result: CaptureResult) -> None:
    warnings = " ".join(result.materials[0].warnings)
    assert "black" not in warnings and "times the median" not in warnings
