"""Tables of the check, the ablation, the similarity, the sweeps and the proposed photo."""

from __future__ import annotations

import numpy as np
from scipy.stats import spearmanr

from .ablation import VARIANTS
from .records import Record, distinct, median, number, ratios, table, values, where


def check(records: list[Record]) -> str:
    """Compare Patina's photos with those of the other renderer."""
    rows = [
        [
            r["tool"], r["material"], f"{r['samples']:,}", f"{r['median']:+.4f}",
            f"{r['scatter']:.4f}", f"{100 * r['relative_l2']:.2f} %", f"{r['worst_20']:.0%}",
        ]
        for r in records
    ]  # fmt: skip
    head = [
        "mesh made by",
        "material",
        "pixels",
        "median of ln(Patina / reference)",
        "robust scatter",
    ]
    return table([*head, "relative L2", "share of the 20 worst pixels"], rows)


def ablation(records: list[Record], key: str) -> str:
    """Return mean ± standard deviation over the runs, one row per scene and material."""
    runs = [r for r in records if "variant" in r]
    rows = []
    for scene in distinct(runs, "scene"):
        for name in distinct(runs, "material"):
            cells = []
            for variant in VARIANTS:
                found = values(where(runs, scene=scene, material=name, variant=variant), key)
                cells.append(f"{number(float(np.mean(found)))} ± {number(float(np.std(found)))}")
            rows.append([scene, name, *cells])
    return table(["scene", "material", *VARIANTS], rows)


def ablation_claims(records: list[Record]) -> str:
    """Return how often each assumption reduces the mean error."""
    runs = [r for r in records if "variant" in r]
    rows = []
    for key, words in (
        ("relative_l2", "whole hemisphere, relative L2"),
        ("specular_l2", "around the specular direction, relative L2"),
        ("log_rms", "to 80°, log-relative RMS"),
    ):
        cells = []
        for variant in list(VARIANTS)[1:]:
            gains = []
            for scene in distinct(runs, "scene"):
                for name in distinct(runs, "material"):
                    mean = [
                        float(
                            np.mean(values(where(runs, scene=scene, material=name, variant=v), key))
                        )
                        for v in (variant, "none")
                    ]
                    gains.append(mean[0] / mean[1])
            better = sum(g < 1 for g in gains)
            cells.append(f"{np.median(gains):.2f} ({better} of {len(gains)})")
        rows.append([words, *cells])
    head = [
        "error with ÷ without the assumption, median (cases where it is lower)",
        *list(VARIANTS)[1:],
    ]
    return table(head, rows)


def similarity(records: list[Record]) -> str:
    """Return the rank correlation of similarity and error within each run, and the error of the
    candidate with the highest similarity."""
    runs = [r for r in records if "candidates" in r]
    rows = []
    for name in distinct(runs, "material"):
        cells = []
        for key in ("log_rms", "relative_l2"):
            ranks, gain, best = [], [], []
            for run in where(runs, material=name):
                errors = np.array([c[key] for c in run["candidates"]])
                similar = np.array([c["similarity"] for c in run["candidates"]])
                ranks.append(float(spearmanr(similar, errors).statistic))
                gain.append(errors[similar.argmax()] / np.median(errors))
                best.append(errors.min() / np.median(errors))
            cells += [
                f"{np.mean(ranks):+.2f} ± {np.std(ranks):.2f}",
                f"{np.median(gain):.2f}",
                f"{np.median(best):.2f}",
            ]
        rows.append([name, *cells])
    head = ["material", "rank correlation, log RMS", "selected ÷ median", "best ÷ median"]
    return table(
        [*head, "rank correlation, relative L2", "selected ÷ median", "best ÷ median"], rows
    )


def sweep(records: list[Record], name: str) -> str:
    """Return medians over materials and seeds: log RMS, and L2 near the specular direction."""
    here = where(records, sweep=name)
    rows = []
    for place in distinct(here, "where"):
        for estimator in distinct(where(here, where=place), "estimator"):
            some = where(here, where=place, estimator=estimator)
            marks = sorted({(r["value"], r["label"]) for r in here})
            cells = []
            for _, label in marks:
                at = where(some, label=label)
                failed = sum("failed" in r for r in at)
                words = f"{number(median(at, 'log_rms'))}, {number(median(at, 'specular_l2'))}"
                cells.append("" if not at else "no fit" if failed == len(at) else words)
            rows.append([place, estimator, *cells])
    labels = [label for _, label in sorted({(r["value"], r["label"]) for r in here})]
    return table(["", "log RMS, specular L2", *labels], rows)


def proposed_photo(records: list[Record]) -> str:
    """Compare a ninth photo that Patina proposes with random ones, one row per capture."""
    rows = []
    for scene in (*distinct(records, "scene"), None):
        here = records if scene is None else where(records, scene=scene)
        kinds = [where(here, estimator=f"{kind} ninth") for kind in ("random", "proposed")]
        eight, (random, proposed) = where(here, estimator="eight photos"), kinds
        cells = [number(median(some, "unseen")) for some in (eight, random, proposed)]
        for below in (random, eight):
            found = list(ratios(proposed, below, "unseen").values())
            cells.append(number(float(np.median(found)), 2))
        grazing = list(ratios(proposed, random, "grazing").values())
        cells += [
            number(float(np.median(grazing)), 2),
            number(median(proposed, "stated"), 2),
            f"{median(proposed, 'angle'):.0f}°",
        ]
        rows.append(["all" if scene is None else scene, *cells])
    head = [
        "capture", "eight photos", "random ninth", "proposed ninth", "proposed ÷ random",
        "proposed ÷ eight", "proposed ÷ random, θd > 65°", "stated uncertainty, nine ÷ eight",
        "lamp from camera",
    ]  # fmt: skip
    return table(head, rows)


def clipped(records: list[Record]) -> str:
    """Compare fits of clipped photos: one row per scene and kind of fit."""
    rows = []
    for scene in distinct(records, "scene"):
        for kind in distinct(records, "estimator"):
            here = where(records, scene=scene, estimator=kind)
            peaks = values(here, "peak")
            within = sum(0.5 <= x <= 2 for x in peaks)
            rows.append(
                [
                    scene, kind,
                    f"{np.median(peaks):.2f} ({min(peaks):.2f} … {max(peaks):.2f})",
                    f"{within} of {len(peaks)}",
                    f"{100 * median(here, 'inside'):.0f} %",
                    number(median(here, "log_rms")),
                    number(median(here, "cube_root")),
                ]
            )  # fmt: skip
    head = [
        "scene", "fit", "peak, fit ÷ truth", "within 0.5 … 2",
        "truth in the 90 % interval at the peak", "log RMS", "cube root",
    ]  # fmt: skip
    return table(head, rows)


def goniometer(records: list[Record]) -> str:
    """Compare fits with the values of a gonioreflectometer: one row per paint, scene and fit."""
    rows = []
    for r in sorted(records, key=lambda r: r["material"]):
        paper = where(records, scene=r["scene"], material=r["material"], estimator="paper")
        ratio = r["log_rms"] / paper[0]["log_rms"] if paper else float("nan")
        rows.append(
            [
                r["material"], r["scene"], r["estimator"], number(r["log_rms"]),
                number(ratio), number(r["brighter_rms"]), number(r["typical"]),
                number(r["peak_rms"]),
                f"{100 * r['inside']:.0f} %" if "inside" in r else "–",
            ]
        )  # fmt: skip
    head = [
        "paint", "scene", "fit", "log RMS", "÷ paper's", "log RMS of values above 0.005 1/sr",
        "median of the absolute logarithm", "log RMS, θh < 10°",
        "measured value in the 90 % interval",
    ]  # fmt: skip
    return table(head, rows)
