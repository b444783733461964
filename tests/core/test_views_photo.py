"""Photos next to predictions, and which pixels became samples: on a ball with a cast shadow,
painted masks of every kind, two materials, clipped pixels and a narrow beam.
"""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from patina.core.basis import PrincipalBRDF, default_basis
from patina.core.capture import Capture, read_capture
from patina.core.concurrency.steps import drained
from patina.core.fit.reliability import below_curvature_limit
from patina.core.geometry import RayScene, view_surface
from patina.core.inputs import capture_data
from patina.core.inputs.lights import Lights, find_lights
from patina.core.inputs.oklab import LINEAR, oklab
from patina.core.inputs.photos import LitPhotos
from patina.core.jobs.sampling import take_samples
from patina.core.samples import Criterion, SampleTable
from patina.core.views import display
from patina.core.views.criteria import LOOKS, PALETTE, UNSELECTED
from patina.core.views.photo_pictures import comparison_picture, criteria_picture
from patina.core.views.photo_view import PhotoView, chosen_pixels, look_at_photo
from tests import make_capture as made

PHOTOS = 3
MATERIALS = '[[material]]\nname = "red"\n[[material]]\nname = "blue"\n'


def mask(**box: tuple[int, int, int, int]) -> dict[str, np.ndarray]:
    """{name: white in rows a:b, columns c:d}."""
    found = {}
    for name, (top, bottom, left, right) in box.items():
        found[name] = np.zeros((made.HEIGHT, made.WIDTH), np.uint8)
        found[name][top:bottom, left:right] = 255
    return found


@pytest.fixture(scope="module")
def painted(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The ball under a second ball that shadows it; two materials whose masks overlap and leave a
    gap; an ignore mask; a clipped corner in the first photo; a narrow beam in the last.
    """
    folder = tmp_path_factory.mktemp("painted")
    path = made.make_capture(folder, PHOTOS, extra=MATERIALS)
    vertices, faces = made.sphere_mesh(3)
    light = next(made.light_directions(PHOTOS))
    moon = 0.25 * (vertices - made.CENTRE) + made.CENTRE + 1.6 * light + [0.0, 0.0, 0.2]
    both = np.concatenate([vertices, moon])
    made.write_ply(folder / "mesh.ply", both, np.concatenate([faces, faces + len(vertices)]))
    text = path.read_text()
    for i in range(1, PHOTOS + 1):
        masks = mask(
            red=(0, 90, 0, 62), blue=(0, 80, 58, 120), shadow=(30, 42, 30, 48),
            highlight=(38, 52, 40, 56), ignore=(50, 60, 20, 90),
        )  # fmt: skip
        named = []
        for name, picture in masks.items():
            made.write_png(folder / f"{i}_{name}.png", picture)
            named.append(f'{name} = "{i}_{name}.png"')
        text = text.replace(
            f'light = "lamp{i}"\n', f'light = "lamp{i}"\nmasks = {{{", ".join(named)}}}\n'
        )
    text = text.replace('file = "lit_1.exr"', 'file = "lit_1.exr"\nsaturation = 0.35')
    last = text.index('name = "lamp3"')
    start, end = text.index("direction", last), text.index("\n\n", last)
    flash = "mounted = [0.3, 0, 0]\nintensity = [20, 20, 20]\nbeam = 1"
    path.write_text(text[:start] + flash + text[end:])
    return path


class Opened:
    """A capture with everything that a view needs."""

    def __init__(self, capture: Capture) -> None:
        self.capture = capture
        self.scan = capture_data.open_scan(capture)
        self.rays = RayScene.build(self.scan.mesh)
        self.photos = LitPhotos.open(capture)
        self.lights: Lights = find_lights(capture, self.scan, self.photos)

    def look(self, place: int, brdfs=(), used=None) -> PhotoView:
        return drained(
            look_at_photo(
                self.capture, self.scan, self.rays, self.photos, self.lights, brdfs, place, used
            )
        )


class KeepAll:
    """A sink that keeps every sample."""

    def __init__(self) -> None:
        self.tables: list[tuple[int, SampleTable]] = []

    def add(self, photo: int, table: SampleTable) -> None:
        self.tables.append((photo, table))

    def of(self, place: int) -> SampleTable:
        return SampleTable.concatenate(
            [SampleTable.empty(), *(t for photo, t in self.tables if photo == place)]
        )


def with_method(path: Path, method: str) -> Capture:
    capture = read_capture(path)
    paper = replace(capture.fit.paper, curvature=0.02)
    return replace(capture, fit=replace(capture.fit, method=method, paper=paper))


@pytest.fixture(scope="module")
def opened(painted: Path) -> Opened:
    return Opened(with_method(painted, "measured"))


@pytest.fixture(scope="module")
def views(opened: Opened) -> list[PhotoView]:
    return [opened.look(place) for place in range(PHOTOS)]


def flat_brdf(level: float) -> PrincipalBRDF:
    """An arbitrary BRDF of the basis."""
    return PrincipalBRDF(default_basis(), np.full((3, 5), level))


def pixels_of(view: PhotoView, *criteria: Criterion) -> set[int]:
    """Flat indices in the whole photo."""
    rows, columns = np.nonzero(np.isin(view.criteria, criteria))
    return set(((rows + view.box[0].start) * made.WIDTH + columns + view.box[1].start).tolist())


@pytest.mark.parametrize("method", ["measured", "paper"])
def test_reliable_pixels_are_exactly_the_samples(painted: Path, method: str) -> None:
    """Of both materials; for the paper's method, those of them that its fit uses."""
    found = Opened(with_method(painted, method))
    capture = found.capture
    sinks = {m.name: [KeepAll()] for m in capture.materials}
    drained(take_samples(capture, found.scan, found.rays, found.photos, found.lights, sinks, 1))
    for place in range(PHOTOS):
        view = found.look(place)
        tables = [kept.of(place) for (kept,) in sinks.values()]
        assert min(map(len, tables)) > 50
        taken = {int(p) for table in tables for p in table.pixel}
        believed = {
            int(p)
            for table in tables
            for p, good in zip(
                table.pixel, below_curvature_limit(table.curvature, 0.02), strict=True
            )
            if good or method == "measured"
        }
        assert pixels_of(view, Criterion.RELIABLE) == believed
        assert pixels_of(view, Criterion.RELIABLE, Criterion.CURVED) == taken
        assert (len(taken) > len(believed) > 0) == (method == "paper")


def test_every_criterion_occurs(opened: Opened, views: list[PhotoView], painted: Path) -> None:
    """The capture above exercises every criterion."""
    curved = Opened(with_method(painted, "paper")).look(0)
    met = {c for view in (*views, curved) for c in np.unique(view.criteria)}
    assert met == set(Criterion)


def test_first_violated_criterion_is_reported(views: list[PhotoView]) -> None:
    view = views[0]

    def criterion_at(row: int, column: int) -> Criterion:
        inside = row - view.box[0].start, column - view.box[1].start
        return Criterion(view.criteria[inside])

    assert criterion_at(40, 44) == Criterion.SHADOW_MASK  # the highlight mask is white here too
    assert criterion_at(45, 52) == Criterion.HIGHLIGHT_MASK
    assert criterion_at(55, 70) == Criterion.IGNORE_MASK
    assert criterion_at(85, 70) == Criterion.NO_MATERIAL
    assert criterion_at(2, 2) == Criterion.NO_SURFACE


def test_attached_and_cast_shadows_are_distinguished(
    opened: Opened, views: list[PhotoView]
) -> None:
    """A back-facing pixel follows from the ball's own shape; the second ball's shadow falls on
    pixels that face the light.
    """
    camera = capture_data.camera_of(opened.capture, opened.scan, 0)
    seen = view_surface(opened.rays, camera)
    light = np.array(next(made.light_directions(PHOTOS)))
    facing = seen.normal @ light
    for criterion, sign in ((Criterion.TURNED_AWAY, -1), (Criterion.CAST_SHADOW, 1)):
        rows = np.isin(seen.pixel, list(pixels_of(views[0], criterion)))
        assert rows.sum() > 20 and (sign * facing[rows] > -1e-6).all()


def test_counts_and_materials_refer_to_surface(opened: Opened, views: list[PhotoView]) -> None:
    for place, view in enumerate(views):
        seen = view_surface(opened.rays, capture_data.camera_of(opened.capture, opened.scan, place))
        assert view.surface == len(seen.pixel) and sum(view.shares.values()) == pytest.approx(1)
        assert view.counts[Criterion.NO_SURFACE] == 0
        assert view.criteria.shape == view.material.shape == view.measured.shape[:2]
        rows, columns = (np.arange(part.start, part.stop) for part in view.box)
        some = view.material >= 0
        assert set(np.unique(view.material)) == {-1, 0, 1}
        red = (columns < 62) & (rows < 90)[:, None]
        blue = (columns >= 58) & (rows < 80)[:, None]  # the last where masks overlap
        assert np.array_equal(view.material, np.where(some, np.where(blue, 1, 0), -1))
        assert (red | blue)[some].all()
        assert not some[view.criteria == Criterion.NO_SURFACE].any()
        nothing = np.isin(view.criteria, (Criterion.NO_SURFACE, Criterion.NO_MATERIAL))
        assert np.array_equal(nothing, ~some)


def test_result_is_independent_of_band_size(
    opened: Opened, views: list[PhotoView], monkeypatch: pytest.MonkeyPatch
) -> None:
    brdf = flat_brdf(0.1)
    whole = opened.look(1, [("red", brdf, 1.0)])
    monkeypatch.setattr("patina.core.views.photo_view.BAND_PIXELS", 1500)
    steps = look_at_photo(
        opened.capture, opened.scan, opened.rays, opened.photos, opened.lights,
        [("red", brdf, 1.0)], 1,
    )  # fmt: skip
    fractions = []
    while True:
        try:
            fractions.append(next(steps))
        except StopIteration as end:
            parts = end.value
            break
    assert len(fractions) > 5 and fractions == sorted(fractions) and fractions[-1] < 1
    assert parts.box == whole.box and np.array_equal(parts.criteria, whole.criteria)
    assert np.allclose(parts.predicted, whole.predicted, rtol=1e-5, equal_nan=True)
    assert np.array_equal(parts.counts, whole.counts)


def test_prediction_uses_given_brdf(opened: Opened) -> None:
    """Works for a BRDF of any fit and for some of the materials; its scale is the factor by which
    it is too large.
    """
    one = opened.look(1, [("red", flat_brdf(0.1), 1.0), ("of another fit", flat_brdf(0.1), 1.0)])
    half = opened.look(1, [("red", flat_brdf(0.1), 2.0)])
    known = np.isfinite(one.predicted[..., 0])
    assert np.array_equal(known, one.material == 0)
    lit = known & (one.predicted > 0).all(axis=-1)
    dark = np.isin(one.criteria, (Criterion.TURNED_AWAY, Criterion.CAST_SHADOW))
    assert lit.sum() > 100 and not one.predicted[known & dark].any()
    assert np.allclose(half.predicted[lit], one.predicted[lit] / 2, rtol=1e-5)
    residual = one.predicted[known] - one.measured[known]
    assert one.error == pytest.approx(
        np.linalg.norm(residual) / np.linalg.norm(one.measured[known]), rel=1e-4
    )


def test_photo_without_mesh_is_no_error(opened: Opened) -> None:
    """A camera that looks the other way."""
    found = Opened(opened.capture)
    away = found.scan.mesh.vertices + 1e3
    mesh = replace(found.scan.mesh, vertices=away)
    found.rays = RayScene.build(mesh)
    view = found.look(0, [("red", flat_brdf(0.1), 1.0)])
    assert view.surface == 0 and view.shares == {} and view.error == 0
    assert criteria_picture(view, 60).shape == (made.HEIGHT // 2, made.WIDTH // 2, 3)


def test_selected_pixels_are_ringed_or_others_paler(opened: Opened, views: list[PhotoView]) -> None:
    plain = criteria_picture(views[0], 500)
    middle = np.argwhere(views[0].criteria == Criterion.RELIABLE)[50]
    row, column = middle + np.array([part.start for part in views[0].box])
    pixel = np.array([row * made.WIDTH + column])
    ringed = opened.look(0, used=pixel)
    assert ringed.chosen.tolist() == [middle.tolist()]
    changed = np.argwhere((criteria_picture(ringed, 500) != plain).any(axis=-1))
    away = np.hypot(*(changed - middle).T)
    assert len(changed) > 50 and away.min() > 2 and away.max() < 11
    reliable = np.array(sorted(pixels_of(views[0], Criterion.RELIABLE)))
    paler = opened.look(0, used=reliable[::2])
    picture = criteria_picture(paler, 500).astype(int)
    same = (picture == plain).all(axis=-1)
    assert (~same).sum() == len(reliable) - len(reliable[::2])
    assert (picture[~same].mean() > plain[~same].mean() + 20).all()
    assert len(opened.look(0, used=np.array([made.HEIGHT * made.WIDTH])).chosen) == 0


def test_pictures_have_requested_size(opened: Opened) -> None:
    view = opened.look(1, [("red", flat_brdf(0.1), 1.0), ("blue", flat_brdf(0.1), 1.0)])
    rows, columns = view.criteria.shape
    full = comparison_picture(view, 500)
    assert full.shape == (rows, 3 * columns + 12, 3) and full.dtype == np.uint8
    small = comparison_picture(view, 40)
    assert max(small.shape[0], (small.shape[1] - 12) // 3) <= 40
    assert criteria_picture(view, 40).shape[0] == small.shape[0]


def test_one_stop_doubles_the_light(opened: Opened) -> None:
    view = opened.look(1, [("red", flat_brdf(0.1), 1.0)])
    columns = view.criteria.shape[1]
    brighter = comparison_picture(view, 500, exposure=1.0)
    known = view.measured.max(axis=-1) < 0.4 * view.white
    expected = display.srgb(2 * view.measured / view.white)
    assert np.array_equal(brighter[:, :columns][known], expected[known])
    doubled = replace(view, predicted=2 * view.predicted, measured=2 * view.measured)
    assert np.array_equal(comparison_picture(doubled, 500), brighter)


def test_paper_selection_is_reproduced(opened: Opened) -> None:
    from patina.core.fit import PaperFit

    table = replace(
        SampleTable.empty(),
        photo=np.array([0, 2, 2], np.int16),
        pixel=np.array([5, 7, 9], np.int32),
    )
    fit = PaperFit(flat_brdf(0.1), table, 1.0, np.zeros(0), np.zeros(0), 3)
    found = chosen_pixels([fit], 2)
    assert found is not None and found.tolist() == [7, 9]
    assert chosen_pixels([], 2) is None


def test_criterion_colours_are_distinguishable_with_colour_blindness() -> None:
    """Without red or without green cones (Machado et al. 2009), and with all three."""
    assert set(LOOKS) == set(Criterion) and len({look.key for look in LOOKS.values()}) == 15
    shown = np.concatenate([PALETTE[1:], [UNSELECTED]]).astype(np.uint8)
    deuteranope = [[0.367, 0.861, -0.228], [0.280, 0.673, 0.047], [-0.012, 0.043, 0.969]]
    protanope = [[0.152, 1.053, -0.205], [0.115, 0.786, 0.099], [-0.004, -0.048, 1.052]]
    for eyes in (np.eye(3), deuteranope, protanope):
        lab = oklab(display.srgb(LINEAR[shown] @ np.array(eyes).T))
        apart = np.linalg.norm(lab[:, None] - lab[None], axis=-1)
        assert apart[np.triu_indices(len(shown), 1)].min() > 0.07


def test_the_guide_explains_every_criterion(root: Path) -> None:
    guide = (root / "docs" / "guide" / "report.md").read_text("utf-8")
    assert all(look.word in guide for look in LOOKS.values())
