"""BRDF charts: curves have the right size, samples lie on the curves, and the raster image agrees
with the SVG drawing."""

from __future__ import annotations

from collections.abc import Callable
from xml.etree import ElementTree

import numpy as np
import pytest

from patina.core.angles import Angles, half_difference
from patina.core.errors import PatinaError
from patina.core.samples import MeasuredPoints, SampleTable
from patina.core.views.charts import CHARTS, View, best_sampled_theta_d, chart
from patina.core.views.drawing import Dots, Drawing, Line, Picture, box
from patina.core.views.highlight_curve import highlight_curve
from patina.core.views.image_slice import ratio_slice
from patina.core.views.polar import in_slice, polar, slice_angles
from patina.core.views.raster import PAPER, inside, raster
from patina.core.views.subject import Show, Subject
from patina.core.views.svg import svg


def flat(rho: float) -> Callable[[Angles], np.ndarray]:
    return lambda a: np.full((len(a.theta_h), 3), rho)


def glossy(a: Angles) -> np.ndarray:
    lobe = 0.05 + 2.0 * np.exp(-((np.asarray(a.theta_h) / 0.1) ** 2))
    return np.repeat(lobe[:, None], 3, axis=1) * np.array([1.0, 0.8, 0.5])


def points_of(angles: Angles, rho: np.ndarray) -> MeasuredPoints:
    n = len(rho)
    return MeasuredPoints(
        Angles(*(np.asarray(a, np.float32) for a in angles)),
        np.asarray(rho, np.float32),
        np.zeros(n, np.int16),
    )


def table_of(theta_h: np.ndarray, theta_d: np.ndarray) -> SampleTable:
    n = len(theta_h)
    one = np.ones(n, np.float32)
    three, vector = np.ones((n, 3), np.float32), np.tile(np.float32([0, 0, 1]), (n, 1))
    return SampleTable(
        photo=np.zeros(n, np.int16), pixel=np.arange(n, dtype=np.int32),
        theta_h=theta_h.astype(np.float32), theta_d=theta_d.astype(np.float32), phi_d=one,
        cos_i=one, cos_o=one, rho=three, radiance=three, variance=0 * three,
        point=np.zeros((n, 3)), normal=vector, view=vector, curvature=one, light=vector,
        irradiance=three, weight=one,
        response=np.ones((n, 3), np.float32),
    )  # fmt: skip


def test_slice_stays_in_the_plane_of_incidence() -> None:
    """At the mirror direction φd is undefined; the slice uses the azimuth of the plane."""
    for incidence in (15, 45, 70):
        theta_o, angles = slice_angles(np.radians(incidence))
        assert not angles.phi_d.any() and angles.theta_h.min() < 1e-6
        half = np.abs(theta_o - np.radians(incidence)) / 2
        assert np.allclose(angles.theta_h, half, atol=1e-6)
        assert np.allclose(angles.theta_d, np.abs(theta_o + np.radians(incidence)) / 2, atol=1e-6)


def polylines(drawing: Drawing, colour: str) -> list[np.ndarray]:
    tree = ElementTree.fromstring(svg(drawing))
    found = [e for e in tree.iter() if e.tag.endswith("polyline") and e.get("stroke") == colour]
    return [np.array([p.split(",") for p in e.get("points").split()], float) for e in found]


def test_polar_chart_is_well_formed_and_scaled() -> None:
    drawing = polar([Subject("x", flat(0.3))], 45)
    for colour in Show().colours:
        (line,) = polylines(drawing, colour)
        assert line[:, 1].min() == pytest.approx(172 - 150 * np.cbrt(0.3 / 0.5), abs=0.2)
    (line,) = polylines(polar([Subject("x", flat(0.25))], 45, Show("linear")), Show().colours[0])
    assert line[:, 1].min() == pytest.approx(172 - 150 * 0.5, abs=0.2)


def test_shaded_interval_spans_its_bounds() -> None:
    subject = Subject("x", flat(0.3), lambda a: (flat(0.2)(a), flat(9.0)(a)))
    tree = ElementTree.fromstring(svg(polar([subject], 45)))
    shapes = [e for e in tree.iter() if e.tag.endswith("polygon")]
    assert len(shapes) == 3
    height = [172 - float(p.split(",")[1]) for p in shapes[0].get("points").split()]
    assert max(height) == pytest.approx(150, abs=0.1)  # clipped at the chart's radius
    n = len(height) // 2
    assert max(height[:n]) == pytest.approx(150 * np.cbrt(0.2 / 0.5), abs=0.1)


def test_samples_in_the_plane_lie_on_the_polar_curve() -> None:
    """Samples in the plane of incidence (also with light and view swapped) are drawn at their own
    direction on the BRDF's curve; samples outside the plane are not drawn."""
    incidence, out = np.radians(40.0), np.radians([-60.0, -20.0, 10.0, 35.0, 70.0])
    light = np.tile([-np.sin(incidence), 0.0, np.cos(incidence)], (5, 1))
    view = np.stack([np.sin(out), np.zeros(5), np.cos(out)], axis=1)
    theta_aside = np.radians([20.0, 30.0, 40.0, 50.0, 60.0])
    aside = np.stack([np.zeros(5), np.sin(theta_aside), np.cos(theta_aside)], axis=1)
    normals = np.tile([0.0, 0.0, 1.0], (5, 1))
    all_angles = [
        half_difference(normals, a, b) for a, b in ((light, view), (view, light), (light, aside))
    ]
    angles = Angles(*(np.concatenate(parts) for parts in zip(*all_angles, strict=True)))
    points = points_of(angles, glossy(angles))
    rows, theta_o = in_slice(points, incidence)
    assert set(rows.tolist()) == set(range(10))
    for row, angle in zip(rows.tolist(), theta_o.tolist(), strict=True):
        assert np.abs(out - angle).min() < 1e-3, (row, np.degrees(angle))
    drawing = polar([Subject("x", glossy, None, points)], 40)
    (dots,) = [p for p in drawing.parts if isinstance(p, Dots)]
    curves = np.concatenate([p.points for p in drawing.parts if isinstance(p, Line)])
    distances = np.hypot(*(dots.points[:, None] - curves[None]).transpose(2, 0, 1)).min(axis=1)
    assert np.median(distances) < 1.5, distances


def test_samples_lie_on_the_highlight_curve() -> None:
    theta_h = np.linspace(0.01, 1.2, 60)
    angles = Angles(theta_h, np.full(60, np.radians(20.0)), np.full(60, np.pi / 2))
    points = points_of(angles, glossy(angles))
    for scale in ("cube_root", "linear", "log"):
        drawing = highlight_curve([Subject("x", glossy, None, points)], 20, Show(scale, True, "r"))
        (dots,) = [p for p in drawing.parts if isinstance(p, Dots)]
        (line,) = polylines(drawing, Show(channels="r").colours[0])
        expected = np.interp(dots.points[:, 0], line[:, 0], line[:, 1])
        assert np.abs(expected - dots.points[:, 1]).max() < 1.5


def test_point_subset_is_small_spread_and_independent_of_order() -> None:
    rng = np.random.default_rng(1)
    dense = np.full(40_000, 0.5), np.full(40_000, 0.5)
    sparse = rng.uniform(0, 0.05, 50), rng.uniform(0.2, 1.0, 50)
    table = table_of(*(np.concatenate(parts) for parts in zip(dense, sparse, strict=True)))
    found = MeasuredPoints.of(table, 1000)
    assert len(found) <= 1000
    assert (found.angles.theta_h < 0.06).sum() == 50, "dense samples displaced the highlight"
    shuffled = MeasuredPoints.of(table.select(rng.permutation(len(table))), 1000)
    assert np.array_equal(np.sort(found.angles.theta_h), np.sort(shuffled.angles.theta_h))
    restored = MeasuredPoints.from_rows(found.rows())
    assert np.array_equal(restored.rho, found.rho) and np.array_equal(restored.photo, found.photo)
    assert not len(MeasuredPoints.of(SampleTable.empty()))
    subject = Subject("x", flat(0.1), None, found)
    assert best_sampled_theta_d(subject) == pytest.approx(np.degrees(0.5), abs=4)


def test_polygon_coverage_equals_its_area() -> None:
    """Coverage of a triangle and of a square with partly covered pixels adds up to the area."""
    corners = np.array([[10.0, 10.0], [40.0, 10.0], [10.0, 50.0]])
    found = inside(corners, 60, 60)
    assert found.sum() == pytest.approx(600, rel=0.01)
    assert found[30, 11] == 1 and found[45, 35] == 0
    square = inside(np.array([[1.5, 1.5], [4.5, 1.5], [4.5, 4.5], [1.5, 4.5]]), 6, 6)
    assert square.sum() == pytest.approx(9, rel=0.2) and square[2:4, 2:4].min() == 1


def test_raster_matches_the_drawing() -> None:
    paper_colour = [int(PAPER[k : k + 2], 16) for k in (1, 3, 5)]
    picture = Picture(40.0, 5.0, 10.0, 10.0, np.full((2, 2, 3), 9, np.uint8))
    line = Line(np.array([[0.0, 50.0], [60.0, 50.0]]), "#0000ff", 2.0, (10.0, 10.0))
    dot = Dots(np.array([[30.0, 30.0]]), np.array([[0, 255, 0]], np.uint8), 4.0)
    drawing = Drawing(60, 60, "x", (box(5, 5, 15, 15, "#ff0000"), picture, line, dot))
    for scale in (1.0, 2.0):
        image = raster(drawing, scale)
        at = lambda x, y, im=image, s=scale: im[int(y * s), int(x * s)].tolist()  # noqa: E731
        assert image.shape == (60 * scale, 60 * scale, 3)
        assert at(10, 10) == [255, 0, 0] and at(45, 10) == [9, 9, 9] and at(30, 30) == [0, 255, 0]
        assert np.abs(np.subtract(at(5, 50), [0, 0, 255])).max() < 5
        assert at(15, 50) == paper_colour and at(55, 20) == paper_colour


def test_every_chart_draws_one_or_two_subjects() -> None:
    angles = Angles(np.array([0.1, 0.4]), np.array([0.3, 0.3]), np.array([1.5, 1.5]))
    subject = Subject(
        "x", glossy, lambda a: (0.8 * glossy(a), 1.2 * glossy(a)), points_of(angles, glossy(angles))
    )
    for kind in CHARTS:
        for other in (None, Subject("y", flat(0.1))):
            if kind == "ratio" and other is None:
                with pytest.raises(PatinaError, match="compare"):
                    chart(kind, subject, other, View())
                continue
            drawing = chart(kind, subject, other, View())
            ElementTree.fromstring(svg(drawing))
            assert raster(drawing, 1.0).std() > 3
    with pytest.raises(PatinaError, match="measured"):
        chart("interval", Subject("x", glossy), None, View())


def test_ratio_chart_is_white_where_two_brdfs_agree() -> None:
    drawing = ratio_slice(Subject("a", flat(0.2)), Subject("b", flat(0.4)), 90)
    pixels = drawing.parts[0].pixels
    assert pixels[60, 60].tolist() == [180, 4, 38], "twice as bright"
    same = ratio_slice(Subject("a", flat(0.2)), Subject("b", flat(0.2)), 90).parts[0].pixels
    assert same[60, 60].tolist() == [236, 236, 236]
