"""The normalised lens parameters that RealityScan writes, in lists and in XMP files."""

from __future__ import annotations

from ..lenses.brown import Lens, brown_lens

FILM_WIDTH = 36.0  # mm, the longer side of a 35 mm film frame


def normalised_lens(values: dict[str, float], size: tuple[int, int]) -> Lens:
    """The lens of f (mm for a 36 mm wide film), px, py (relative to the photo's centre, in units of
    its larger side), k1 … k4, t1, t2 (OpenCV's p2, p1)."""
    width, height = size
    larger = max(size)
    f = values["f"] / FILM_WIDTH * larger
    cx, cy = values["px"] * larger + width / 2, values["py"] * larger + height / 2
    radial = [values[f"k{i}"] for i in (1, 2, 3, 4)]
    return brown_lens(f, f, cx, cy, radial, (values["t2"], values["t1"]))
