"""The figures of docs/method/experiments.md, drawn from records."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from ..common import ROOT
from . import svg
from .ablation import INCIDENCE, VARIANTS
from .half_circle import half_circle
from .records import Record, distinct, median, values, where

FOLDER = ROOT / "docs" / "images" / "experiments"
SLICES = {
    "none": "no assumption (Nielsen)",
    "all": "the paper's full method",
    "ours": "ours",
}
LINES = {"paper": 0, "all samples k=20": 1, "ours": 2}
MEASURES = {
    "relative_l2": "whole hemisphere: relative L2",
    "specular_l2": "around the specular direction: relative L2",
    "log_rms": "to 80°: log-relative RMS",
}


def write(name: str, drawing: str) -> Path:
    """Write one figure; return its file."""
    FOLDER.mkdir(parents=True, exist_ok=True)
    file = FOLDER / name
    file.write_text(drawing, "utf-8")
    return file


def polar(records: list[Record], scene: str) -> str:
    """Figure 9: truth solid, fit dashed; one row per material, one column per method."""
    here = [r for r in where(records, scene=scene) if "slice" in r]
    kinds = [k for k in SLICES if where(here, kind=k)]
    panels = []
    for name in distinct(here, "material"):
        slices = {r["kind"]: r["slice"] for r in where(here, material=name)}
        for kind in kinds:
            panels.append(
                half_circle(
                    f"{name} · {SLICES[kind]}",
                    [(np.array(slices["truth"]), ""), (np.array(slices[kind]), "4 3")],
                    INCIDENCE,
                    max(float(np.max(slices[k])) for k in ("truth", *kinds)),
                )
            )
    head = svg.legend(
        [
            ("truth", svg.INK, ""),
            ("fit (red, green, blue channel)", svg.INK, "4 3"),
            ("light; rings: ρ in 1/sr; radius: ∛ρ", "#e0a000", "2 3"),
        ]
    )
    return svg.sheet(panels, len(kinds), (310, 188), head, "Polar slices in the plane of incidence")


def ablation(records: list[Record]) -> str:
    """Figure 10: mean and standard deviation over the runs."""
    runs = [r for r in records if "variant" in r]
    names, panels = distinct(runs, "material"), []
    for scene in distinct(runs, "scene"):
        for key, words in MEASURES.items():
            here = where(runs, scene=scene)
            means = {
                (m, v): values(where(here, material=m, variant=v), key)
                for m in names
                for v in VARIANTS
            }
            tops = [np.mean(x) + np.std(x) for x in means.values()]
            lows = [max(np.mean(x) - np.std(x), 0.3 * np.mean(x)) for x in means.values()]
            chart = svg.Chart(
                f"{scene}, {words}", "", "error", (-0.5, len(names) - 0.5),
                (float(min(lows)) * 0.85, float(max(tops)) * 1.15),
                y_log=True, x_ticks=[(i, n) for i, n in enumerate(names)], width=520, height=230,
            )  # fmt: skip
            for i, name in enumerate(names):
                if i % 2:
                    chart.shade(i - 0.5, i + 0.5)
                for j, variant in enumerate(VARIANTS):
                    mean = float(np.mean(means[name, variant]))
                    spread = float(np.std(means[name, variant]))
                    at = i + (j - 2) * 0.16
                    chart.whisker(at, mean - spread, mean + spread, svg.COLOURS[j])
                    chart.dot(at, mean, svg.COLOURS[j], 3.6)
            panels.append(chart.drawing())
    head = svg.legend([(v, svg.COLOURS[j], "bar") for j, v in enumerate(VARIANTS)])
    return svg.sheet(panels, len(MEASURES), (520, 230), head, "Ablation of the paper's assumptions")


def similarity(records: list[Record]) -> str:
    """Figure 11: cosine similarity of every candidate against its error; selected ones ringed."""
    runs = [r for r in records if "candidates" in r]
    scenes, panels = distinct(runs, "scene"), []
    for name in distinct(runs, "material"):
        here = where(runs, material=name)
        every = [c for r in here for c in r["candidates"]]
        xs = np.array([c["similarity"] for c in every])
        low = max(float(np.quantile(xs, 0.02)), 1 - 3 * (1 - float(np.median(xs))))
        ys = np.array([c["log_rms"] for c in every if c["similarity"] >= low])
        chart = svg.Chart(
            name, "cosine similarity of photos and prediction", "log-relative RMS",
            (low, float(xs.max()) + 0.02 * (xs.max() - low)), (0.0, float(ys.max()) * 1.08),
        )  # fmt: skip
        for record in here:
            colour = svg.COLOURS[scenes.index(record["scene"])]
            shown = [c for c in record["candidates"] if c["similarity"] >= low]
            for c in shown:
                chart.dot(c["similarity"], c["log_rms"], colour)
            best = max(record["candidates"], key=lambda c: c["similarity"])
            chart.ring(best["similarity"], best["log_rms"], colour)
        panels.append(chart.drawing())
    head = svg.legend([(s, svg.COLOURS[i], "bar") for i, s in enumerate(scenes)])
    return svg.sheet(panels, 3, (300, 220), head, "Similarity against error")


def sweep(records: list[Record], sweeps: list[str], x_label: dict[str, str]) -> str:
    """One panel per sweep and scene: median log-relative RMS over materials and seeds."""
    panels = []
    drawn: set[str] = set()
    for name in sweeps:
        for place in distinct(where(records, sweep=name), "where"):
            here = where(records, sweep=name, where=place)
            panels.append(_sweep_panel(here, f"{place}, {name}", x_label[name], drawn))
    head = svg.legend([(k, svg.COLOURS[i], "") for k, i in LINES.items() if k in drawn])
    return svg.sheet(panels, min(len(panels), 3), (300, 220), head, "Error against one setting")


def _sweep_panel(here: list[Record], title: str, x_label: str, drawn: set[str]) -> str:
    marks = sorted({(r["value"], r["label"]) for r in here})
    place = {label: i for i, (_, label) in enumerate(marks)}
    curves: dict[str, list[tuple[int, float]]] = {}
    for estimator in distinct(here, "estimator"):
        if estimator not in LINES:
            continue
        points = [
            (i, median(where(here, estimator=estimator, label=label), "log_rms"))
            for label, i in place.items()
        ]
        curves[estimator] = [(i, y) for i, y in points if np.isfinite(y)]
    top = max(y for points in curves.values() for _, y in points)
    chart = svg.Chart(
        title, x_label, "log-relative RMS", (-0.3, len(place) - 0.7), (0.0, top * 1.1),
        x_ticks=[(i, label.removeprefix("OpenMVS ")) for label, i in place.items()],
    )  # fmt: skip
    for estimator, points in curves.items():
        drawn.add(estimator)
        xs, ys = [x for x, _ in points], [y for _, y in points]
        chart.line(xs, ys, svg.COLOURS[LINES[estimator]])
    return chart.drawing()
