"""Write the marked parts of docs/method/experiments.md and appearance.md from stored results."""

from __future__ import annotations

import re
from collections.abc import Callable, Sequence
from functools import partial
from pathlib import Path

from matplotlib.figure import Figure

from ..common import ROOT, say
from . import appearance, figures, goal_table, store, tables
from .ablation import SCENES
from .estimators import MERL_PRIOR
from .records import Record, distinct, where

DOCUMENT = ROOT / "docs" / "method" / "experiments.md"
APPEARANCE = ROOT / "docs" / "method" / "appearance.md"
IMAGES = "../images/experiments"
ESTIMATORS = (
    "paper", "all samples k=20", "ours", MERL_PRIOR, "ours, true mesh",
    "all samples k=40, true mesh", "floor k=20", "floor k=40", "floor k=100",
)  # fmt: skip
X_LABELS = {
    "samples": "number of samples in the fit",
    "curvature": "largest curvature allowed, 1/pixel",
    "photos": "lit photos",
    "mesh error, bumpy": "median normal error, degrees",
    "mesh error, blurred": "median normal error, degrees",
    "stereo tool": "mesh made by",
}
SUMMARISED = (
    "check", "goals", "by scene", "priors", "clipped", "proposed photo", "goniometer", "models",
    "models by material",
)  # fmt: skip
Section = Callable[[list[Record]], str]


def sections() -> dict[str, tuple[str, Section]]:
    """Return marker → (experiment, function that makes the text) of experiments.md."""
    found: dict[str, tuple[str, Section]] = {
        "check": ("check", tables.check),
        "goals": ("goals", goal_table.goals),
        "by scene": ("goals", lambda r: goal_table.by_scene(r, _present(r))),
        "by material": ("goals", lambda r: goal_table.by_material(r, _present(r))),
        "in-basis": ("goals", goal_table.in_basis),
        "priors": ("goals", goal_table.priors),
        "clipped": ("clipped", tables.clipped),
        "proposed photo": ("proposed_photo", tables.proposed_photo),
        "goniometer": ("goniometer", tables.goniometer),
        "polar": ("ablation", _polar),
        "ablation": ("ablation", _ablation),
        "similarity": ("ablation", _similarity),
    }
    for name in ("samples", "curvature", "photos", "mesh error", "stereo tool"):
        found[name] = ("sweeps", partial(_sweep, name))
    return found


def appearance_sections() -> dict[str, tuple[str, Section]]:
    """Return the same for docs/method/appearance.md."""
    return {
        "models": ("appearance", appearance.summary),
        "models by material": ("appearance", appearance.by_material),
        "worst": ("appearance", appearance.worst),
    }


def write(names: Sequence[str]) -> None:
    """Write the marked parts of these experiments if results are stored; keep all other text."""
    for document, found in ((DOCUMENT, sections()), (APPEARANCE, appearance_sections())):
        mine = {marker: part for marker, part in found.items() if part[0] in names}
        if mine:
            _fill(document, mine)


def _fill(document: Path, found: dict[str, tuple[str, Section]]) -> None:
    text = document.read_text("utf-8")
    for marker, (experiment, make) in found.items():
        records = store.load(experiment)
        if not records:
            say(f"{marker}: no stored results of {experiment!r}; this part was not changed")
            continue
        if content := make(records):
            text = replaced(text, marker, content)
    document.write_text(text, "utf-8")
    say(f"wrote {document.relative_to(ROOT)}")


def summary() -> str:
    """Return the tables of the quick runs, for the terminal."""
    parts = []
    for marker in SUMMARISED:
        experiment, make = (sections() | appearance_sections())[marker]
        if records := store.load(experiment, quick=True):
            parts.append(f"## {marker}\n\n{make(records)}")
    runs = store.load("ablation", quick=True) or []
    if runs:
        parts.append(f"## ablation\n\n{tables.ablation(runs, 'log_rms')}")
    for name in distinct(store.load("sweeps", quick=True) or [], "sweep"):
        parts.append(f"## {name}\n\n{tables.sweep(store.load('sweeps', quick=True) or [], name)}")
    return "\n".join(parts)


def replaced(text: str, marker: str, content: str) -> str:
    """Return the text with the part between the two comments of a marker replaced.

    Raises ValueError if the text has no such marker.
    """
    begin, end = f"<!-- begin {marker} -->", f"<!-- end {marker} -->"
    pattern = re.compile(re.escape(begin) + ".*?" + re.escape(end), re.DOTALL)
    if not pattern.search(text):
        raise ValueError(f"found no part {marker!r} in the document")
    return pattern.sub(lambda _: f"{begin}\n{content.strip()}\n{end}", text)


def _present(records: list[Record]) -> list[str]:
    names = distinct(records, "estimator")
    return [name for name in ESTIMATORS if name in names]


def _polar(records: list[Record]) -> str:
    out = []
    for scene in SCENES:
        if where(records, scene=scene):
            drawing = figures.polar(records, scene)
            out.append(
                _picture(drawing, f"polar-{scene}.svg", f"Polar slices, six materials, {scene}")
            )
    return "\n\n".join(out)


def _ablation(records: list[Record]) -> str:
    drawing = figures.ablation(records)
    return "\n\n".join(
        [
            _picture(drawing, "ablation.svg", "Ablation: bars of five variants for six materials"),
            tables.ablation_claims(records),
            "Around the specular direction, relative L2, mean ± standard deviation:",
            tables.ablation(records, "specular_l2"),
            "Whole hemisphere, relative L2:",
            tables.ablation(records, "relative_l2"),
        ]
    )


def _similarity(records: list[Record]) -> str:
    picture = _picture(
        figures.similarity(records), "similarity.svg", "Cosine similarity against log-relative RMS"
    )
    return f"{picture}\n\n{tables.similarity(records)}"


def _sweep(name: str, records: list[Record]) -> str:
    sweeps = [s for s in distinct(records, "sweep") if s == name or s.startswith(f"{name},")]
    if not sweeps:
        return ""
    drawing = figures.sweep(records, sweeps, X_LABELS)
    parts = [_picture(drawing, f"{name.replace(' ', '-')}.svg", f"Error against {name}")]
    for sweep in sweeps:
        parts += [f"{sweep[0].upper()}{sweep[1:]}:", tables.sweep(records, sweep)]
    return "\n\n".join(parts)


def _picture(drawing: Figure, name: str, title: str) -> str:
    """Write a figure; return the Markdown that shows it."""
    figures.write(name, drawing, title)
    return f"![{title}]({IMAGES}/{name})"
