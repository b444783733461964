"""Samples taken in bands equal those of the whole photo, for any number of threads."""

from __future__ import annotations

from dataclasses import fields, replace
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.ndimage import binary_dilation, generate_binary_structure

from patina.core.capture import read_capture
from patina.core.concurrency.ordered_map import ordered_map
from patina.core.concurrency.steps import drained
from patina.core.geometry import PixelRays, RayScene, bands, edges, view_surface, view_window
from patina.core.geometry.window import whole
from patina.core.inputs import capture_data
from patina.core.inputs.lights import find_lights
from patina.core.inputs.photos import LitPhotos
from patina.core.jobs import FitJob, sampling
from patina.core.jobs.sampling import take_samples
from patina.core.samples import Margins, SampleReservoir, SampleTable, sample_photo, take, weighted
from patina.core.samples.reservoir import ALL, sample_hash, water_level
from patina.core.samples.take import halo, inner_pixels, light_surface, trusted_pixels
from patina.core.scan import Camera, Mesh
from patina.core.scan.camera import Pose
from tests import make_capture as made

VIEW = ("pixel", "face", "point", "normal", "view", "curvature")


@pytest.fixture(scope="module")
def ball(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return made.make_capture(tmp_path_factory.mktemp("ball"))


def same(a: np.ndarray, b: np.ndarray) -> bool:
    return a.dtype == b.dtype and a.shape == b.shape and a.tobytes() == b.tobytes()


def rough_ball() -> Mesh:
    """Hills that shadow and hide each other."""
    vertices, faces = made.sphere_mesh(5)
    local = vertices - made.CENTRE
    hills = 1 + 0.12 * np.sin(local * [5.0, 4.0, 6.0]).sum(axis=1, keepdims=True)
    return Mesh(made.CENTRE + local * hills, faces.astype(np.int32))


def lens_with_distortion(size: int) -> Camera:
    rotation, translation = next(iter(made.poses(6)))
    return Camera(
        "c", size, size * 3 // 4, "OPENCV",
        (1.5 * size, 1.52 * size, 0.49 * size, 0.37 * size, -0.12, 0.05, 1e-3, -2e-3),
        Pose(rotation, translation),
    )  # fmt: skip


@pytest.mark.parametrize(
    "margins", [Margins(), Margins(5, 7, 3), Margins(0, 0, 0), Margins(1, 9, 1)]
)
def test_bands_equal_whole_frame(ball: Path, margins: Margins) -> None:
    """Cut at every few rows and at the mesh's columns, against one window of the whole frame: equal
    bits.
    """
    capture = read_capture(ball)
    scan = capture_data.open_scan(capture)
    rays = RayScene.build(rough_ball())
    photos = LitPhotos.open(capture)
    light = find_lights(capture, scan, photos).of(capture, 1)
    camera = capture_data.camera_of(capture, scan, 1)
    radiance = photos.read(1).radiance
    lines = PixelRays.of(camera)
    stripes = np.zeros((camera.height, camera.width), bool)
    stripes[20:55, 30:80] = True

    def samples(windows: list) -> list[SampleTable]:
        found = []
        for window in windows:
            view = view_window(rays, lines, window)
            lighting = light_surface(rays, view, light, camera)
            keep = trusted_pixels(view, lighting, margins)
            keep &= inner_pixels(view, stripes.ravel()[view.pixel], margins)
            wanted = np.zeros(len(keep), bool)
            wanted[view.wanted] = True
            found.append(sample_photo(view, lighting, radiance, keep & wanted))
        return found

    one = samples([whole(camera)])[0]
    columns = rays.cover.columns(camera)
    for pixels in (1, 1500, 4000):
        cut = list(bands(camera, halo(margins), columns, pixels))
        assert len(cut) > 1 or 4 * halo(margins) > camera.height // 2
        many = SampleTable.concatenate(samples(cut))
        for field in fields(SampleTable):
            assert same(getattr(one, field.name), getattr(many, field.name)), field.name
    assert len(one) > 60


def test_view_of_frame_equals_its_bands(monkeypatch: pytest.MonkeyPatch) -> None:
    rays, camera = RayScene.build(rough_ball()), lens_with_distortion(160)
    one = view_window(rays, PixelRays.of(camera), whole(camera))
    monkeypatch.setattr(
        "patina.core.geometry.view.bands", lambda c, halo, columns: bands(c, halo, columns, 900)
    )
    many = view_surface(rays, camera)
    for name in VIEW:
        assert same(getattr(one, name), getattr(many, name)), name
    assert np.array_equal(one.seen, many.seen) and np.array_equal(one.silhouette, many.silhouette)
    assert np.array_equal(many.image(many.curvature), one.image(one.curvature), equal_nan=True)


def test_interpolated_rays_match_lens() -> None:
    camera = lens_with_distortion(640)
    lines = PixelRays.of(camera)
    assert lines.lattice is not None
    rows, columns = np.mgrid[0:480, 0:640]
    exact = camera.rays(np.stack([columns.ravel() + 0.5, rows.ravel() + 0.5], axis=1))
    away = np.linalg.norm(lines.window(0, 480, 0, 640).T - exact, axis=1)
    assert away.max() < 0.003 / camera.parameters[0]  # 0.003 pixels
    assert same(
        lines.window(33, 40, 50, 90),
        lines.window(0, 480, 0, 640).reshape(3, 480, 640)[:, 33:40, 50:90].reshape(3, -1),
    )


def test_lens_without_cubic_approximation_is_evaluated_at_every_pixel() -> None:
    camera = replace(
        lens_with_distortion(640), model="RADIAL", parameters=(200.0, 320.0, 240.0, 0.9, 30.0)
    )
    assert PixelRays.of(camera).lattice is None


@pytest.mark.parametrize("away", [1.5, 2.5, 6.0])
def test_skipped_columns_contain_no_hit(away: float) -> None:
    """Columns that are skipped hold no hit, from near (next to the mesh) to far."""
    rays = RayScene.build(rough_ball())
    rotation, _ = next(iter(made.poses(6)))
    for turn in (0.0, 0.4):
        c, s = np.cos(turn), np.sin(turn)
        turned = np.array([[c, 0, s], [0, 1, 0], [-s, 0, c]]) @ rotation
        eye = made.CENTRE - away * rotation[2]
        camera = replace(lens_with_distortion(200), pose=Pose(turned, -turned @ eye))
        seen = view_window(rays, PixelRays.of(camera), whole(camera)).seen
        may = np.zeros_like(seen)
        for block, (first, last) in enumerate(rays.cover.columns(camera)):
            may[16 * block : 16 * block + 16, first:last] = True
        assert not (seen & ~may).any()


@pytest.mark.parametrize("plane", [-3.0, 0.0, 3.0])
def test_orthographic_camera_skips_columns_and_sees_what_is_behind_its_plane(plane: float) -> None:
    rays = RayScene.build(rough_ball())
    rotation, _ = next(iter(made.poses(6)))
    pose = Pose(rotation, -rotation @ made.CENTRE + (0, 0, plane))
    lens = {"model": "ORTHOGRAPHIC", "parameters": (30.0, 30.0, 90.0, 80.0)}
    camera = replace(lens_with_distortion(200), pose=pose, **lens)
    seen = view_window(rays, PixelRays.of(camera), whole(camera)).seen
    may = np.zeros_like(seen)
    for block, (first, last) in enumerate(rays.cover.columns(camera)):
        may[16 * block : 16 * block + 16, first:last] = True
    assert seen.any() and not (seen & ~may).any() and may.mean() < 0.6


def test_widening_equals_repeated_dilation() -> None:
    edge = np.random.default_rng(0).random((40, 50)) < 0.01
    for pixels in range(6):
        expected = edge
        for step in range(pixels):
            expected = binary_dilation(expected, generate_binary_structure(2, 1 + step % 2))
        assert np.array_equal(edges.widen(edge, pixels), expected)


def test_threads_and_bands_do_not_change_bytes(ball: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    capture = read_capture(ball)
    scan = capture_data.open_scan(capture)
    rays, photos = RayScene.build(scan.mesh), LitPhotos.open(capture)
    lights = find_lights(capture, scan, photos)
    found = []
    for threads, pixels in ((1, 1 << 20), (1, 1000), (2, 1000), (3, 2500)):
        monkeypatch.setattr(
            sampling, "bands", lambda c, halo, columns, p=pixels: bands(c, halo, columns, p)
        )
        taken = drained(take_samples(capture, scan, rays, photos, lights, threads=threads))
        table = taken.kept["surface"].table()
        found.append([getattr(table, f.name).tobytes() for f in fields(table)])
        assert taken.counts["surface"].sum() == len(table)
        assert np.array_equal(np.bincount(table.photo), taken.counts["surface"])
    assert all(one == found[0] for one in found)


def test_samples_that_would_be_dropped_are_left_out_without_changing_bytes(
    ball: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    capture = read_capture(ball)
    scan = capture_data.open_scan(capture)
    rays, photos = RayScene.build(scan.mesh), LitPhotos.open(capture)
    lights = find_lights(capture, scan, photos)
    taken_rows: list[int] = []

    def counted(*arguments: Any) -> SampleTable:
        taken_rows.append(len(arguments[3]))
        return take.sample_rows(*arguments)

    monkeypatch.setattr(sampling, "SampleReservoir", partial(SampleReservoir, size=2000))
    monkeypatch.setattr(sampling, "bands", lambda c, halo, columns: bands(c, halo, columns, 2000))
    monkeypatch.setattr(sampling, "sample_rows", counted)
    found = []
    for everything in (False, True):
        if everything:
            monkeypatch.setattr(SampleReservoir, "limit", lambda self, photo: ALL)
        taken_rows.clear()
        taken = drained(take_samples(capture, scan, rays, photos, lights, threads=2))
        table = taken.kept["surface"].table()
        found.append([getattr(table, f.name).tobytes() for f in fields(table)])
        count = taken.counts["surface"].sum()
        assert count > 3 * len(table)
        assert sum(taken_rows) == count if everything else sum(taken_rows) < 0.8 * count
    assert found[0] == found[1]


@pytest.mark.slow
@pytest.mark.parametrize("method", ["measured", "paper"])
def test_job_gives_same_bytes_for_any_thread_count(
    ball: Path, monkeypatch: pytest.MonkeyPatch, method: str
) -> None:
    """Also where the reservoir has to drop samples."""
    few = partial(SampleReservoir, size=4000)
    monkeypatch.setattr(sampling, "SampleReservoir", few)
    monkeypatch.setattr(
        sampling, "bands", lambda c, halo, columns: bands(c, halo, columns, pixels=3000)
    )
    capture = read_capture(ball)
    capture = replace(capture, fit=replace(capture.fit, method=method))
    found = []
    for threads in (1, 2):
        job = FitJob(capture, threads=threads, portable=False)
        job.drain()
        assert job.result is not None
        one = job.result.materials[0]
        assert one.used <= 4001 < one.samples
        found.append((one.fit.brdf.coefficients.tobytes(), one.per_photo, one.held_out, one.spread))
    assert found[0] == found[1]


def test_sink_receives_each_sample_once_in_order(ball: Path) -> None:
    class Sink:
        def __init__(self) -> None:
            self.pieces: list[SampleTable] = []

        def add(self, photo: int, table: SampleTable) -> None:
            assert (table.photo == photo).all()
            self.pieces.append(table)

    capture, sink = read_capture(ball), Sink()
    scan = capture_data.open_scan(capture)
    photos = LitPhotos.open(capture)
    lights = find_lights(capture, scan, photos)
    steps = take_samples(
        capture, scan, RayScene.build(scan.mesh), photos, lights, {"surface": [sink]}, 2
    )
    table = drained(steps).kept["surface"].table()
    joined = SampleTable.concatenate(sink.pieces)
    assert same(joined.rho, table.rho) and same(joined.pixel, table.pixel)


def distinct_samples(photo: int, pixels: np.ndarray) -> SampleTable:
    """Samples that can be distinguished from each other."""
    n = len(pixels)
    flat, vectors = np.full(n, 0.5, np.float32), np.ones((n, 3), np.float32)
    return replace(
        SampleTable.empty(), photo=np.full(n, photo, np.int16), pixel=pixels.astype(np.int32),
        theta_h=flat, theta_d=flat, phi_d=flat, cos_i=flat, cos_o=flat, curvature=flat,
        radiance=vectors * pixels[:, None].astype(np.float32), normal=vectors, view=vectors,
        rho=vectors, light=vectors, irradiance=vectors, point=vectors.astype(float),
        weight=np.ones(n, np.float32), response=np.ones((n, 3), np.float32),
        variance=0 * vectors,
    )  # fmt: skip


@settings(max_examples=40, deadline=None)
@given(
    counts=st.lists(st.integers(0, 300), min_size=1, max_size=5),
    size=st.integers(1, 400),
    seed=st.integers(0, 1000),
)
def test_reservoir_is_independent_of_pieces_and_order(counts, size, seed) -> None:
    rng = np.random.default_rng(seed)
    pieces = []
    for photo, count in enumerate(counts):
        pixels = rng.choice(5000, count, replace=False)
        pieces += [
            distinct_samples(photo, part)
            for part in np.array_split(np.sort(pixels), 3)
            if len(part)
        ]
    kept = []
    for order in (range(len(pieces)), rng.permutation(len(pieces))):
        reservoir = SampleReservoir(len(counts), size)
        for i in order:
            reservoir.add(int(pieces[i].photo[0]), pieces[i])
        table = reservoir.table()
        kept.append(table.photo.astype(np.int64) << 32 | table.pixel)
    assert np.array_equal(kept[0], kept[1]) and (np.diff(kept[0]) > 0).all()
    if not pieces:
        assert len(kept[0]) == 0
        return
    # by its definition, from all samples at once; the brightest samples are kept in addition
    everything = SampleTable.concatenate(pieces)
    place = everything.photo.astype(np.int64) << 32 | everything.pixel
    number = sample_hash(everything.photo, everything.pixel)
    if len(place) <= size:
        assert np.array_equal(kept[0], np.sort(place)) and (table.weight == 1).all()
        return
    come = np.bincount(everything.photo)
    room = max(next(r for r in range(size, -1, -1) if np.minimum(come, r).sum() <= size), 1)
    expected = set()
    for photo in np.flatnonzero(come):
        rows = np.flatnonzero(everything.photo == photo)
        expected |= set(place[rows[np.argsort(number[rows])[:room]]].tolist())
    bright = everything.radiance[:, 0].max()
    expected.add(int(place[everything.radiance[:, 0] == bright].min()))
    assert set(kept[0].tolist()) == expected
    # every sample is represented
    assert len(place) - 1e-3 <= table.weight.sum() <= len(place) + 1 + 1e-3


def test_reservoir_is_representative_sample() -> None:
    """Kept pixels are spread evenly: each tenth of a photo's rows keeps a tenth of its pixels.

    A photo with few pixels keeps all of them, and weights say how many rows each stands for.
    """
    reservoir = SampleReservoir(3, 4000)
    for photo, count in ((0, 50_000), (1, 500), (2, 20_000)):
        for part in np.array_split(np.arange(count), 7):
            reservoir.add(photo, distinct_samples(photo, part))
    table = reservoir.table()
    assert 3998 <= len(table) <= 4001
    assert np.bincount(table.photo)[1] == 500
    for photo, count in ((0, 50_000), (1, 500), (2, 20_000)):
        own = table.select(table.photo == photo)
        share = np.bincount(own.pixel * 10 // count, minlength=10) / len(own)
        assert np.abs(share - 0.1).max() < 5 * np.sqrt(0.09 / len(own))
        assert abs(own.weight.sum() - count) <= 0.001 * count + 1
    assert weighted.thinned(table)


@settings(max_examples=100, deadline=None)
@given(counts=st.lists(st.integers(0, 50), min_size=1, max_size=9), size=st.integers(0, 300))
def test_quota_per_photo_is_largest_that_fits(counts: list[int], size: int) -> None:
    level, array = water_level(np.array(counts), size), np.array(counts)
    assert np.minimum(array, level).sum() <= size
    if level < array.max():
        assert np.minimum(array, level + 1).sum() > size


@settings(max_examples=60, deadline=None)
@given(
    values=st.lists(st.floats(-10, 10), min_size=1, max_size=20),
    times=st.lists(st.integers(1, 5), min_size=20, max_size=20),
)
def test_weighted_median_splits_total_weight(values, times) -> None:
    numbers, weight = np.array(values), np.array(times[: len(values)], float)
    found = weighted.median(numbers, weight)
    everything = np.repeat(numbers, weight.astype(int))
    if weight.min() == weight.max():
        assert found == np.median(numbers)
    else:
        assert (everything < found).mean() <= 0.5 and (everything > found).mean() <= 0.5


def test_hashes_of_all_positions_differ() -> None:
    photo, pixel = np.divmod(np.arange(200_000), 1000)
    assert len(np.unique(sample_hash(photo, pixel))) == 200_000


def test_ordered_map_keeps_order_and_raises_errors() -> None:
    from concurrent.futures import ThreadPoolExecutor

    def work(i: int) -> int:
        if i == 7:
            raise ValueError("seven")
        return i * i

    with ThreadPoolExecutor(3) as pool:
        assert list(ordered_map(pool, work, range(6), ahead=2)) == [0, 1, 4, 9, 16, 25]
        with pytest.raises(ValueError, match="seven"):
            list(ordered_map(pool, work, range(9), ahead=2))


def test_no_precision_loss_far_from_origin() -> None:
    """A georeferenced mesh: 500 km away the same pixels see the same surface."""
    mesh, camera = rough_ball(), lens_with_distortion(120)
    shift = np.array([500_000.0, 4_000_000.0, 100.0])
    moved = replace(mesh, vertices=mesh.vertices + shift)
    pose = Pose(camera.pose.rotation, camera.pose.translation - camera.pose.rotation @ shift)
    near = view_surface(RayScene.build(mesh), camera)
    far = view_surface(RayScene.build(moved), replace(camera, pose=pose))
    assert (near.seen != far.seen).sum() <= 3
    both, there, other = np.intersect1d(near.pixel, far.pixel, return_indices=True)
    assert len(both) > 3000
    assert np.percentile(np.abs(far.point[other] - shift - near.point[there]), 99) < 1e-6
    assert np.percentile(np.abs(far.normal[other] - near.normal[there]), 99) < 1e-4
