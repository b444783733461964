"""Charts of the residual: drawn within their frame, with the values under the pointer."""

from __future__ import annotations

import xml.etree.ElementTree as ET

import numpy as np
import pytest

from patina.core.diagnose.selection.residual_trends import Trend
from patina.core.report.trend_chart import HEIGHT, WIDTH, trend_chart

AT = np.array([5.0, 20.0, 40.0, 70.0])
BEFORE = Trend(AT, np.array([0.02, -0.01, 0.0, 0.1]), np.full(4, 0.005))
AFTER = Trend(AT[1:], np.array([0.004, 0.0, -0.02]), np.full(3, 0.001))


@pytest.mark.parametrize("after", [None, AFTER], ids=["before", "both"])
def test_every_place_shows_its_values_under_the_pointer(after: Trend | None) -> None:
    drawn = ET.fromstring(trend_chart("angle <θ>", "°", BEFORE, after, 0.1))
    strips = [rect for rect in drawn.iter("rect") if rect.get("class") == "strip"]
    titles = [strip.findtext("title") for strip in strips]
    assert len(strips) == len(AT)
    left = [float(strip.get("x")) for strip in strips]
    right = [x + float(s.get("width")) for x, s in zip(left, strips, strict=True)]
    assert left[1:] == pytest.approx(right[:-1], abs=0.11)  # no gap, no overlap
    assert left[0] > 0 and right[-1] <= WIDTH
    if after is None:
        assert titles[0] == "5 °: +2.0 ± 1.0 %"
    else:
        assert titles[0] == "5 °: before +2.0 ± 1.0 %"
        assert titles[1] == "20 °: before -1.0 ± 1.0 %; after +0.4 ± 0.2 %"
    heights = [float(line.get(key)) for line in drawn.iter("line") for key in ("y1", "y2")]
    assert len(heights) > 10 and all(0 <= y <= HEIGHT for y in heights)


def test_a_chart_without_bins_is_empty() -> None:
    none = Trend(np.zeros(0), np.zeros(0), np.zeros(0))
    assert trend_chart("angle", "°", none, None, 0.1) == ""
