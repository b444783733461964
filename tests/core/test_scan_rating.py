"""Figures of a scan's quality are rated; a poor figure is one that the check names as a cause."""

from __future__ import annotations

import pytest

from patina.core.diagnose.assessment.scan_rating import rated_figures
from patina.core.diagnose.selection import unusual_scan
from patina.core.diagnose.selection.scan_quality import ScanQuality
from patina.core.fit.fit_quality import Rating


@pytest.mark.parametrize(
    ("quality", "expected"),
    [
        (ScanQuality(1.0, 0.2, 0.03, 0.05), ["good", "good", "good"]),
        (ScanQuality(2.0, 1.0, 0.2, 0.05), ["fair", "fair", "fair"]),
        (ScanQuality(3.0, 2.0, 0.5, 0.05), ["poor", "poor", "poor"]),
        (ScanQuality(None, 0.2, 0.03, None), ["good", "good"]),
    ],
)
def test_figures_are_rated(quality: ScanQuality, expected: list[str]) -> None:
    assert [figure.rating.value for figure in rated_figures(quality.figures())] == expected


def test_poor_is_what_the_check_names() -> None:
    limits = (
        unusual_scan.UNUSUAL_NORMALS,
        unusual_scan.UNUSUAL_POSES,
        unusual_scan.UNUSUAL_MATERIAL,
    )
    for factor, poor in ((0.999, False), (1.001, True)):
        figures = rated_figures(ScanQuality(*(factor * limit for limit in limits), None).figures())
        assert [figure.rating is Rating.POOR for figure in figures] == [poor] * 3
