"""The style that all charts of the experiments share, and their SVG files."""

from __future__ import annotations

import math
import re
from io import StringIO

import matplotlib.style
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.ticker import LogLocator, NullFormatter

BLACK, ORANGE, SKY_BLUE, GREEN = "#000000", "#E69F00", "#56B4E9", "#009E73"
BLUE, VERMILION, PURPLE = "#0072B2", "#D55E00", "#CC79A7"
COLOURS = (BLUE, VERMILION, GREEN, PURPLE, ORANGE, SKY_BLUE)
"""Okabe and Ito's palette, which people with colour vision deficiency can tell apart. Its yellow is
left out: it is too pale for lines on white."""
MARKERS = ("o", "s", "^", "D", "v", "P")
"""One for each colour, for prints without colours."""
INK, GRID, SHADE = "#333333", "#dddddd", "#f3f3f3"
WIDTH = 7.5
"""Width of a figure in inches: 720 pixels in a browser, the width of a page of the documentation,
so that text is shown in its nominal size."""

STYLE = {
    "font.family": "sans-serif",
    "font.sans-serif": ["DejaVu Sans"],
    "font.size": 8,
    "axes.titlesize": 8.5,
    "axes.labelsize": 8,
    "xtick.labelsize": 7.5,
    "ytick.labelsize": 7.5,
    "legend.fontsize": 8,
    "legend.frameon": False,
    "axes.edgecolor": INK,
    "axes.linewidth": 0.7,
    "axes.spines.top": False,
    "axes.spines.right": False,
    "axes.axisbelow": True,
    "axes.grid.axis": "y",
    "axes.grid": True,
    "grid.color": GRID,
    "grid.linewidth": 0.6,
    "lines.linewidth": 1.4,
    "lines.markersize": 4,
    "path.simplify": True,
    "path.simplify_threshold": 0.25,  # points
    "svg.fonttype": "none",  # text remains text: searchable, and a small file
    "svg.hashsalt": "patina",  # the same identifiers in each run
}

styled = matplotlib.style.context(["default", STYLE])
"""Decorator of functions that draw: matplotlib's defaults with STYLE, whatever the user has set."""


@styled
def svg(figure: Figure, title: str) -> str:
    """Return a figure as the text of an SVG file; ``title`` is read out by screen readers.

    The same figure always gives the same text: it contains no date and no version. To make files
    smaller by a third, coordinates are rounded to 0.01 points, and indentation and rotations by 0°
    are removed.
    """
    file = StringIO()
    figure.savefig(file, format="svg", metadata={"Title": title, "Date": None, "Creator": None})
    text = re.sub(r' d="[^"]*"', lambda path: _rounded(path.group()), file.getvalue())
    text = re.sub(r' transform="rotate\(-?0 [^"]*\)"', "", text)
    return "\n".join(line.strip() for line in text.splitlines()) + "\n"


def _rounded(path: str) -> str:
    return re.sub(r"-?\d+\.\d{3,}", lambda number: f"{float(number.group()):.2f}", path)


LOG_STEPS = ((1.0,), (1.0, 3.0), (1.0, 2.0, 5.0), (1.0, 1.5, 2.0, 3.0, 4.0, 5.0, 7.0))
MIN_TICKS = 3


def logarithmic_y(axes: Axes, low: float, high: float) -> None:
    """Make the y axis logarithmic from low to high, with plain numbers as tick labels."""
    axes.set_yscale("log")
    axes.set_ylim(low, high)
    ticks = log_ticks(low, high)
    axes.set_yticks(ticks, [f"{tick:g}" for tick in ticks])
    axes.yaxis.set_minor_locator(LogLocator(subs="all"))
    axes.yaxis.set_minor_formatter(NullFormatter())


def log_ticks(low: float, high: float) -> list[float]:
    """Return round values from low to high: the fewest that are at least MIN_TICKS, if possible."""
    ticks: list[float] = []
    for steps in LOG_STEPS:
        powers = range(math.floor(math.log10(low)), math.ceil(math.log10(high)) + 1)
        values = [float(f"{step}e{power}") for power in powers for step in steps]
        ticks = [value for value in values if low <= value <= high]
        if len(ticks) >= MIN_TICKS:
            break
    return ticks
