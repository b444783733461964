"""The charts of the experiments, from hand-written records."""

from __future__ import annotations

from pathlib import Path
from xml.etree import ElementTree

import numpy as np
import pytest
from matplotlib.figure import Figure

from tools.experiments import chart_style, figures
from tools.experiments.ablation import INCIDENCE, VARIANTS
from tools.experiments.half_circle import slice_angles
from tools.experiments.records import Record

MATERIALS = ("a & b", "t < 1")
X_LABELS = {"photos": "lit photos", "stereo tool": "mesh made by"}


def texts(figure: Figure) -> list[str]:
    root = ElementTree.fromstring(chart_style.svg(figure, "title"))
    return ["".join(e.itertext()) for e in root.iter("{http://www.w3.org/2000/svg}text")]


def ablation_records(seeds: int = 3) -> list[Record]:
    return [
        {"scene": "knot", "material": material, "variant": variant, "seed": seed,
         "relative_l2": 10.0 ** (i + j) * (1 + 0.1 * seed), "specular_l2": 1.0 + seed,
         "log_rms": 0.2 + 0.1 * seed}
        for i, material in enumerate(MATERIALS)
        for j, variant in enumerate(VARIANTS)
        for seed in range(seeds)
    ]  # fmt: skip


def sweep_records(sweep: str, settings: dict[str, float]) -> list[Record]:
    return [
        {"sweep": sweep, "where": "knot", "value": value, "label": label, "material": material,
         "estimator": estimator, "log_rms": factor / value + offset, "specular_l2": 0.5}
        for label, value in settings.items()
        for material, offset in (("a", 0.0), ("b", 0.1), ("c", 0.3))
        for estimator, factor in (("paper", 1.0), ("ours", 0.5), ("all samples k=6", 1.0))
    ]  # fmt: skip


def slice_records() -> list[Record]:
    count = len(slice_angles(np.radians(INCIDENCE))[0])
    values = {"truth": [0.125, 0.25, 0.5], "ours": [0.1, 0.2, 0.4], "all": [0.3, 0.3, 0.3]}
    return [
        {"scene": "knot", "material": material, "kind": kind, "slice": [value] * count}
        for material in MATERIALS
        for kind, value in values.items()
    ]


def candidate_records() -> list[Record]:
    candidates = [{"similarity": 0.99 + s / 1000, "log_rms": 0.3 - s / 100} for s in range(8)]
    return [
        {"scene": scene, "material": material, "candidates": candidates}
        for scene in ("knot", "jar")
        for material in MATERIALS
    ]


def test_ablation_shows_mean_and_standard_deviation_on_a_logarithmic_axis() -> None:
    figure = figures.ablation(ablation_records())
    axes = figure.axes[0]
    assert axes.get_yscale() == "log"
    assert len(axes.containers) == len(VARIANTS)
    for j, (line, _, (bars,)) in enumerate(axes.containers):
        means = 1.1 * 10.0 ** np.array([j, j + 1])  # of factors 1, 1.1 and 1.2
        deviations = means / 1.1 * 0.1 * np.sqrt(2 / 3)
        np.testing.assert_allclose(line.get_ydata(), means)
        ends = np.array([segment[:, 1] for segment in bars.get_segments()])
        np.testing.assert_allclose(ends, np.stack([means - deviations, means + deviations], 1))
    low, middle, high = axes.transData.transform([(0, 1.0), (0, 10.0), (0, 100.0)])[:, 1]
    assert middle == pytest.approx((low + high) / 2) and low < middle < high


def test_ablation_has_labels_of_scene_materials_variants_and_ticks() -> None:
    found = texts(figures.ablation(ablation_records()))
    assert {"knot", "material", *MATERIALS, *VARIANTS} <= set(found)
    assert "relative L2 error" in " ".join(found)
    assert {"1", "10", "100"} <= set(found)


def test_sweep_draws_the_medians_of_each_estimator_in_order() -> None:
    figure = figures.sweep(
        sweep_records("photos", {"16": 16, "2": 2, "8": 8}), ["photos"], X_LABELS
    )
    (axes,) = figure.axes
    curves = [line.get_xydata() for line in axes.lines]
    assert len(curves) == 2  # estimators outside LINES have no curve
    np.testing.assert_allclose(curves[0], [(0, 0.6), (1, 0.225), (2, 0.1625)])
    np.testing.assert_allclose(curves[1], [(0, 0.35), (1, 0.1625), (2, 0.13125)])
    found = texts(figure)
    assert {"knot, photos", "lit photos", "2", "8", "16", "paper", "ours"} <= set(found)
    assert "all samples k=20" not in found  # the legend names only what is drawn
    assert axes.get_ylim()[0] == 0


def test_settings_without_a_finite_error_are_left_out_of_a_curve() -> None:
    records = sweep_records("photos", {"2": 2, "8": 8})
    failed = [{k: v for k, v in r.items() if k != "log_rms"} if r["value"] == 2 else r
              for r in records if r["estimator"] == "paper"]  # fmt: skip
    labels, curves = figures.sweep_curves(failed)
    assert labels == ["2", "8"] and curves["paper"][0] == [1]
    np.testing.assert_allclose(curves["paper"][1], [0.225])


def test_settings_without_an_order_are_not_connected() -> None:
    records = sweep_records("stereo tool", {"true mesh": 1, "MVE": 2})
    (axes,) = figures.sweep(records, ["stereo tool"], X_LABELS).axes
    assert {line.get_linestyle() for line in axes.lines} == {"None"}


def test_similarity_rings_the_most_similar_candidate() -> None:
    figure = figures.similarity(candidate_records())
    titles = [axes.get_title() for axes in figure.axes]
    assert titles == list(MATERIALS)
    for axes in figure.axes:
        points, rings = axes.lines[0::2], axes.lines[1::2]
        assert len(points) == len(rings) == 2  # one of each for each scene
        for line in points:
            xs, ys = line.get_xydata().T
            np.testing.assert_allclose(ys, 0.3 - (xs - 0.99) * 10)
        for line in rings:
            np.testing.assert_allclose(line.get_xydata(), [(0.997, 0.23)])
    assert {"knot", "jar", *MATERIALS} <= set(texts(figure))


def test_similarity_leaves_out_outliers() -> None:
    similarities = [0.99, 0.99, 0.99, 0.98, 0.1]
    records = [{"candidates": [{"similarity": s} for s in similarities]}]
    assert figures.lowest_shown(records) == pytest.approx(0.97)


def test_half_circle_radius_is_the_cube_root_of_the_brdf() -> None:
    figure = figures.polar(slice_records(), "knot")
    assert len(figure.axes) == 4  # two materials, and the two methods that have slices
    theta, _ = slice_angles(np.radians(INCIDENCE))
    light, *curves = figure.axes[0].lines
    np.testing.assert_allclose(light.get_xdata(), -np.radians(INCIDENCE))
    assert len(curves) == 6  # three channels of truth and fit
    for curve, value in zip(curves, (0.125, 0.25, 0.5, 0.3, 0.3, 0.3), strict=True):
        np.testing.assert_allclose(curve.get_xdata(), theta)
        np.testing.assert_allclose(curve.get_ydata(), np.cbrt(value / 0.5))  # outer ring: 0.5
    found = texts(figure)
    assert found.count("0.5") == 4 and {"truth", "fit", *MATERIALS} <= set(found)
    assert "ours" in found and "no assumption (Nielsen)" not in found


def test_log_ticks_are_round_and_at_least_three() -> None:
    assert figures.chart_style.log_ticks(0.5, 2000) == [1, 10, 100, 1000]
    assert figures.chart_style.log_ticks(0.17, 0.48) == [0.2, 0.3, 0.4]
    assert figures.chart_style.log_ticks(0.2, 4) == [0.3, 1, 3]


def test_file_is_small_and_the_same_in_each_run(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(figures, "FOLDER", tmp_path)
    records = ablation_records()
    first = figures.write("a.svg", figures.ablation(records), "Ablation").read_bytes()
    second = figures.write("b.svg", figures.ablation(records), "Ablation").read_bytes()
    assert first == second
    assert len(first) < 150_000
    root = ElementTree.fromstring(first)
    assert root.findtext("{http://www.w3.org/2000/svg}title") == "Ablation"
    assert b"<dc:date>" not in first and b"matplotlib.org" not in first
