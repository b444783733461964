"""The figures of docs/method/experiments.md, drawn from records."""

from __future__ import annotations

from pathlib import Path

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from matplotlib.projections.polar import PolarAxes

from ..common import ROOT
from . import chart_style
from .ablation import INCIDENCE, VARIANTS
from .chart_style import COLOURS, INK, MARKERS, SHADE, WIDTH, styled
from .half_circle import CHANNELS, FIT, LIGHT, TRUTH, half_circle
from .records import Record, distinct, median, values, where

FOLDER = ROOT / "docs" / "images" / "experiments"
SLICES = {
    "none": "no assumption (Nielsen)",
    "all": "the paper's full method",
    "ours": "ours",
}
LINES = {"paper": 0, "all samples k=20": 1, "ours": 2}
"""Estimator of a sweep → index of its colour and marker."""
NOMINAL = {"stereo tool"}
"""Sweeps whose settings have no order; their points are not connected."""
MEASURES = {
    "relative_l2": "whole hemisphere,\nrelative L2 error",
    "specular_l2": "near specular direction,\nrelative L2 error",
    "log_rms": "up to 80°,\nlog-relative RMS error",
}
LOG_RMS = "log-relative RMS error"
SLICE_WIDTH, COLUMN, ROW = 2.06, 2.37, 1.42
"""Diameter of a half-circle, and the distances between the centres of two, in inches."""
LEFT, ABOVE, BELOW = 0.55, 0.72, 0.5
"""Margins to the left of the first half-circle, above the first row, below the last, in inches."""


def write(name: str, figure: Figure, title: str) -> Path:
    """Write one figure; return its file."""
    FOLDER.mkdir(parents=True, exist_ok=True)
    file = FOLDER / name
    file.write_text(chart_style.svg(figure, title), "utf-8")
    return file


@styled
def polar(records: list[Record], scene: str) -> Figure:
    """Figure 9: truth solid, fit dashed; one row per material, one column per method."""
    here = [r for r in where(records, scene=scene) if "slice" in r]
    kinds = [k for k in SLICES if where(here, kind=k)]
    names = distinct(here, "material")
    figure, grid = _half_circle_grid(len(names), len(kinds))
    for row, name in zip(grid, names, strict=True):
        slices = {r["kind"]: np.array(r["slice"]) for r in where(here, material=name)}
        top = max(float(np.max(slices[k])) for k in ("truth", *kinds))
        for axes, kind in zip(row, kinds, strict=True):
            half_circle(axes, [(slices["truth"], TRUTH), (slices[kind], FIT)], INCIDENCE, top)
        row[0].text(
            -0.12, 0.5, name, transform=row[0].transAxes, rotation=90, ha="right", va="center",
            fontsize=8.5,
        )  # fmt: skip
    for axes, kind in zip(grid[0], kinds, strict=True):
        axes.set_title(SLICES[kind], y=0.85)
    for axes in grid[-1]:
        axes.text(
            0.5, 0.1, "ρ, 1/sr (radius: ∛ρ)", transform=axes.transAxes, ha="center", va="center"
        )
    keys = [
        Line2D([], [], color=INK, label="truth", **TRUTH),
        Line2D([], [], color=INK, label="fit", **FIT),
        *(Line2D([], [], color=c, label=f"{name} channel") for name, c in CHANNELS.items()),
        Line2D([], [], label="direction of the light", **LIGHT),
    ]
    figure.legend(handles=keys, loc="upper center", ncols=len(keys), columnspacing=1.4)
    return figure


def _half_circle_grid(rows: int, columns: int) -> tuple[Figure, list[list[PolarAxes]]]:
    """Return a figure with polar axes in rows and columns.

    matplotlib centres a half-circle in a square, so that half of the square is empty. The squares
    overlap here, the half-circles do not.
    """
    height = (rows - 1) * ROW + SLICE_WIDTH / 2 + ABOVE + BELOW
    figure = Figure(figsize=(WIDTH, height))
    grid = [
        [
            figure.add_axes(
                (
                    (LEFT + column * COLUMN) / WIDTH,
                    (BELOW + (rows - 1 - row) * ROW - SLICE_WIDTH / 4) / height,
                    SLICE_WIDTH / WIDTH,
                    SLICE_WIDTH / height,
                ),
                projection="polar",
            )
            for column in range(columns)
        ]
        for row in range(rows)
    ]
    return figure, grid


@styled
def ablation(records: list[Record]) -> Figure:
    """Figure 10: mean and standard deviation over the runs."""
    runs = [r for r in records if "variant" in r]
    scenes, names = distinct(runs, "scene"), distinct(runs, "material")
    figure = Figure(figsize=(WIDTH, 7.0), layout="constrained")
    grid = figure.subplots(len(MEASURES), len(scenes), squeeze=False, sharex=True, sharey="row")
    for row, (key, label) in zip(grid, MEASURES.items(), strict=True):
        ranges = []
        for axes, scene in zip(row, scenes, strict=True):
            ranges.append(_ablation_panel(axes, where(runs, scene=scene), names, key))
        low, high = min(r[0] for r in ranges), max(r[1] for r in ranges)
        chart_style.logarithmic_y(row[0], low * 0.85, high * 1.15)
        row[0].set_ylabel(label)
    for axes, scene in zip(grid[0], scenes, strict=True):
        axes.set_title(scene)
    for axes in grid.flat:
        axes.label_outer(remove_inner_ticks=True)
    for axes in grid[-1]:
        axes.set_xticks(range(len(names)), names, rotation=30, ha="right", rotation_mode="anchor")
        axes.set_xlabel("material")
    _legend(figure, _point_keys(list(VARIANTS)))
    return figure


def mean_and_deviation(records: list[Record], key: str) -> tuple[float, float]:
    """Return the mean and the standard deviation of a measure over the runs."""
    found = values(records, key)
    return float(np.mean(found)), float(np.std(found))


def _ablation_panel(
    axes: Axes, here: list[Record], names: list[str], key: str
) -> tuple[float, float]:
    """Draw one panel; return the smallest and the largest error that it must show."""
    for i in range(1, len(names), 2):
        axes.axvspan(i - 0.5, i + 0.5, color=SHADE, linewidth=0, zorder=0)
    low, high = np.inf, 0.0
    for j, variant in enumerate(VARIANTS):
        found = [mean_and_deviation(where(here, material=n, variant=variant), key) for n in names]
        means, deviations = np.array(found).T
        axes.errorbar(
            np.arange(len(names)) + (j - (len(VARIANTS) - 1) / 2) * 0.16, means, deviations,
            color=COLOURS[j], marker=MARKERS[j], markersize=3.5, linestyle="none",
            elinewidth=1.0, capsize=1.8,
        )  # fmt: skip
        # an error bar that reaches to 0 has no end on a logarithmic axis
        low = min(low, float(np.min(np.maximum(means - deviations, 0.3 * means))))
        high = max(high, float(np.max(means + deviations)))
    axes.set_xlim(-0.5, len(names) - 0.5)
    axes.tick_params(axis="x", length=0)
    return low, high


@styled
def similarity(records: list[Record]) -> Figure:
    """Figure 11: cosine similarity of every candidate against its error; selected ones ringed."""
    runs = [r for r in records if "candidates" in r]
    scenes, names = distinct(runs, "scene"), distinct(runs, "material")
    columns = min(len(names), 3)
    rows = -(-len(names) // columns)
    figure = Figure(figsize=(WIDTH, 2.2 * rows + 0.6), layout="constrained")
    grid = figure.subplots(rows, columns, squeeze=False)
    for axes, name in zip(grid.flat, names, strict=False):
        here = where(runs, material=name)
        low = lowest_shown(here)
        for i, scene in enumerate(scenes):
            found = where(here, scene=scene)
            shown = [c for r in found for c in r["candidates"] if c["similarity"] >= low]
            _scatter(
                axes, shown, color=COLOURS[i], marker=MARKERS[i], alpha=0.75, markeredgewidth=0
            )
            best = [max(r["candidates"], key=lambda c: c["similarity"]) for r in found]
            _scatter(
                axes, best, color=INK, marker="o", markersize=8, markerfacecolor="none",
                markeredgewidth=0.9,
            )  # fmt: skip
        axes.set_title(name)
        axes.set_ylim(bottom=0)
        axes.locator_params(axis="x", nbins=4)
    for axes in grid.flat[len(names) :]:
        axes.set_visible(False)
    for axes in grid[:, 0]:
        axes.set_ylabel(LOG_RMS)
    figure.supxlabel("cosine similarity of photos and prediction", fontsize=8)
    ring = Line2D(
        [], [], color=INK, marker="o", markersize=8, markerfacecolor="none", linestyle="none",
        markeredgewidth=0.9, label="selected by the paper's method",
    )  # fmt: skip
    _legend(figure, [*_point_keys(scenes), ring])
    return figure


def lowest_shown(records: list[Record]) -> float:
    """Return the smallest similarity that is shown: outliers would squeeze all other points."""
    found = np.array([c["similarity"] for r in records for c in r["candidates"]])
    return max(float(np.quantile(found, 0.02)), 1 - 3 * (1 - float(np.median(found))))


def _scatter(axes: Axes, candidates: list[Record], **style: object) -> None:
    xs, ys = [c["similarity"] for c in candidates], [c["log_rms"] for c in candidates]
    axes.plot(xs, ys, linestyle="none", **style)


@styled
def sweep(records: list[Record], sweeps: list[str], x_label: dict[str, str]) -> Figure:
    """One panel per sweep and scene: median log-relative RMS over materials and seeds."""
    panels = [
        (name, place) for name in sweeps for place in distinct(where(records, sweep=name), "where")
    ]
    columns = min(len(panels), 3)
    rows = -(-len(panels) // columns)
    width = WIDTH if columns > 1 else 0.6 * WIDTH
    figure = Figure(figsize=(width, 2.5 * rows + 0.4), layout="constrained")
    grid = figure.subplots(rows, columns, squeeze=False, sharey=True)
    drawn: list[str] = []
    line = "none" if NOMINAL.issuperset(sweeps) else "-"
    for axes, (name, place) in zip(grid.flat, panels, strict=False):
        here = where(records, sweep=name, where=place)
        labels, curves = sweep_curves(here)
        for estimator, (xs, ys) in curves.items():
            look = LINES[estimator]
            axes.plot(
                xs, ys, color=COLOURS[look], marker=MARKERS[look], linestyle=line, clip_on=False
            )
            drawn.append(estimator)
        axes.set_xticks(range(len(labels)), [label.replace(" ", "\n") for label in labels])
        axes.set_xlim(-0.3, len(labels) - 0.7)
        axes.set_title(f"{place}, {name}")
        axes.set_xlabel(x_label[name])
    for axes in grid.flat[len(panels) :]:
        axes.set_visible(False)
    grid[0, 0].set_ylim(bottom=0)
    for axes in grid[:, 0]:
        axes.set_ylabel(f"median {LOG_RMS}")
    keys = [
        Line2D([], [], label=estimator, color=COLOURS[i], marker=MARKERS[i], linestyle=line)
        for estimator, i in LINES.items()
        if estimator in drawn
    ]
    _legend(figure, keys)
    return figure


def sweep_curves(here: list[Record]) -> tuple[list[str], dict[str, tuple[list[int], list[float]]]]:
    """Return the labels of the settings in order, and estimator → (positions among the labels,
    median log-relative RMS). Settings without a finite error are left out of a curve."""
    settings = sorted({(r["value"], r["label"]) for r in here})
    labels = list(dict.fromkeys(label for _, label in settings))
    curves = {}
    for estimator in distinct(here, "estimator"):
        if estimator in LINES:
            mine = where(here, estimator=estimator)
            errors = [median(where(mine, label=label), "log_rms") for label in labels]
            xs = [i for i, y in enumerate(errors) if np.isfinite(y)]
            curves[estimator] = (xs, [errors[i] for i in xs])
    return labels, curves


def _point_keys(labels: list[str]) -> list[Line2D]:
    return [
        Line2D([], [], color=COLOURS[i], marker=MARKERS[i], linestyle="none", label=label)
        for i, label in enumerate(labels)
    ]


def _legend(figure: Figure, keys: list[Line2D]) -> None:
    """Add a legend in one row above all panels."""
    figure.legend(handles=keys, loc="outside upper center", ncols=len(keys))
