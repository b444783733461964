"""Clipped samples of a fit are lower limits: the peak neither vanishes nor is it made up."""

from __future__ import annotations

from dataclasses import replace
from functools import partial
from pathlib import Path

import numpy as np
import pytest

from patina.core.angles import Angles, cosines
from patina.core.basis import default_basis
from patina.core.capture import read_capture
from patina.core.concurrency.steps import drained
from patina.core.fit.measured import MeasuredFit, MeasuredSettings, fit_measured
from patina.core.fit.measured.cells import gather
from patina.core.fit.measured.normals import with_normals
from patina.core.fit.measured_result import MeasuredResult
from patina.core.geometry import RayScene
from patina.core.inputs import capture_data
from patina.core.inputs.lights import find_lights
from patina.core.inputs.photos import LitPhotos
from patina.core.jobs import FitJob, sampling
from patina.core.jobs.sampling import take_samples
from patina.core.samples import SampleTable
from patina.core.samples.clipped import WHITE_MARGIN, White
from patina.core.samples.reservoir import SampleReservoir
from tests import make_capture as made

WHITE = 1.2  # radiance at which the photos are clipped; the highlights reach 2.5
SETTINGS = MeasuredSettings(rounds=0, normal_deviation=0.1)  # the mesh of the ball is exact
PEAK = Angles(*np.radians([[0.5, 1.0, 2.0], [20.0, 25.0, 30.0], [90.0, 60.0, 120.0]]))


@pytest.fixture(scope="module")
def path(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A glossy ball (Blinn, not of the basis) whose photos are clipped at WHITE."""
    path = made.make_capture(tmp_path_factory.mktemp("clipped"), photos=6)
    text = path.read_text()
    for number in range(1, 7):
        line = f'file = "lit_{number}.exr"'
        text = text.replace(line, f"{line}\nsaturation = {WHITE}")
    path.write_text(text)
    return path


@pytest.fixture(scope="module")
def tables(path: Path) -> tuple[SampleTable, SampleTable]:
    """(measured, clipped) samples."""
    capture = read_capture(path)
    scan = capture_data.open_scan(capture)
    photos = LitPhotos.open(capture)
    lights = find_lights(capture, scan, photos)
    taken = drained(take_samples(capture, scan, RayScene.build(scan.mesh), photos, lights))
    (name,) = taken.kept
    return taken.kept[name].table(), taken.clipped[name].table()


def test_clipped_samples_are_thinned_as_the_measured_ones_are(path, tables, monkeypatch) -> None:
    """A capture of more samples than are kept: of each photo about as large a fraction of the
    clipped ones is kept, and each represents as many pixels as a measured one of its photo."""
    measured, clipped = tables
    few = partial(SampleReservoir, size=len(measured) // 10)
    monkeypatch.setattr(
        sampling,
        "SampleReservoir",
        lambda count, size=None: few(count) if size is None else SampleReservoir(count, size),
    )
    capture = read_capture(path)
    scan = capture_data.open_scan(capture)
    photos = LitPhotos.open(capture)
    lights = find_lights(capture, scan, photos)
    taken = drained(take_samples(capture, scan, RayScene.build(scan.mesh), photos, lights))
    (kept,), (limits,) = taken.tables(list(taken.kept))
    assert len(kept) < 0.11 * len(measured)
    assert len(limits) / len(clipped) == pytest.approx(len(kept) / len(measured), rel=0.3)
    assert limits.weight.sum() == pytest.approx(clipped.weight.sum(), rel=0.3)
    for photo in np.unique(limits.photo):
        own, other = (float(t.weight[t.photo == photo].mean()) for t in (limits, kept))
        assert own == pytest.approx(other, rel=0.25)  # estimates from a hundred samples


@pytest.fixture(scope="module")
def fits(tables: tuple[SampleTable, SampleTable]) -> dict[str, MeasuredFit]:
    measured, clipped = tables
    basis = default_basis()
    return {
        "dropped": fit_measured(measured, basis, SETTINGS),
        "limits": fit_measured(measured, basis, SETTINGS, clipped),
    }


def truth(angles: Angles) -> np.ndarray:
    """(n, 3) ρ of the ball: Blinn's lobe depends on θh alone."""
    lobe = np.cos(angles.theta_h) ** 60
    return np.array([0.16, 0.05, 0.04]) + 0.8 * lobe[:, None]


def test_clipped_channels_are_those_at_white(tables: tuple[SampleTable, SampleTable]) -> None:
    measured, clipped = tables
    assert measured.read.all() and not clipped.read.any()
    assert 0.02 < len(clipped) / len(measured) < 0.3
    limit = clipped.response == 0
    # pixels within 1 % of the white are clipped, and values are rounded
    assert clipped.radiance[limit].min() > 0.97 * WHITE
    assert clipped.radiance[~limit].max() < WHITE
    assert measured.radiance.max() < WHITE
    both = set(zip(measured.photo.tolist(), measured.pixel.tolist(), strict=True))
    assert both.isdisjoint(zip(clipped.photo.tolist(), clipped.pixel.tolist(), strict=True))


def test_white_is_that_of_the_least_clipped_pixel() -> None:
    radiance = np.zeros((2, 2, 3), np.float32)
    radiance[0] = [[0.2, 1.0, 0.1], [2.0, 0.1, 0.1]]
    usable = np.array([[False, False], [True, True]])
    assert White.of(radiance, usable).level == pytest.approx(WHITE_MARGIN)
    assert White.of(radiance, np.ones((2, 2), bool)).level == np.inf
    radiance[1, 0] = 0  # clipped in all exposures of a bracket: nothing is known
    usable[1, 0] = False
    assert White.of(radiance, usable).level == pytest.approx(WHITE_MARGIN)


def test_limits_bring_the_peak_back(fits: dict[str, MeasuredFit]) -> None:
    true = truth(PEAK)
    ratio = {name: fit.brdf.evaluate(PEAK) / true for name, fit in fits.items()}
    error = {name: np.abs(np.log(values)).mean() for name, values in ratio.items()}
    assert error["limits"] < 0.8 * error["dropped"]
    assert (ratio["limits"] > 0.5).all() and (ratio["limits"] < 2.0).all()


def coat(angles: Angles) -> np.ndarray:
    """(n, 3) ρ of a coat on a dark base: Walter et al. 2007, equations 33 and 34."""
    alpha, f0 = 0.15, 0.05
    cos_h, cos_d = np.cos(angles.theta_h), np.cos(angles.theta_d)
    both = cosines(*angles)
    distribution = alpha**2 / (np.pi * (cos_h**2 * (alpha**2 - 1) + 1) ** 2)
    fresnel = f0 + (1 - f0) * (1 - cos_d) ** 5
    smith = 1 + sum((np.sqrt(1 + alpha**2 * (1 / c**2 - 1)) - 1) / 2 for c in both)
    lobe = distribution * fresnel / (4 * smith * both[0] * both[1])
    return np.array([0.06, 0.05, 0.04]) + lobe[:, None]


def test_errors_of_the_normals_do_not_select_samples(
    tables: tuple[SampleTable, SampleTable],
) -> None:
    """Where a wrong normal says that a pixel is on the highlight, it is clipped or dark: the cells
    of the dark ones alone would say that there is no highlight. The white level is a third of the
    peak."""
    deviation = 1.5  # degrees along each axis
    table = SampleTable.concatenate(list(tables))
    light = coat(Angles(*(a.astype(float) for a in table.angles))) * table.cos_i[:, None]
    table = replace(table, radiance=(light * table.irradiance).astype(np.float32))
    white = np.percentile(table.radiance.max(axis=1), 95).astype(np.float32)
    error = np.random.default_rng(4).normal(0, np.radians(deviation), table.normal.shape)
    turned = table.normal + error
    turned /= np.linalg.norm(turned, axis=1, keepdims=True)
    cos_i, cos_o = (np.sum(turned * to, axis=1) for to in (table.light, table.view))
    seen = np.minimum(cos_i, cos_o) > 0.05
    table = with_normals(table.select(seen), turned[seen])
    limited = table.radiance > white
    clipped = replace(
        table,
        radiance=np.minimum(table.radiance, white),
        response=(~limited).astype(np.float32),
    ).select(limited.any(axis=1))
    settings = MeasuredSettings(rounds=0, normal_deviation=deviation)
    fit = fit_measured(table.select(~limited.any(axis=1)), default_basis(), settings, clipped)
    ratio = fit.brdf.evaluate(PEAK) / coat(PEAK)
    assert np.abs(np.log(ratio)).mean() < np.log(1.25)


def test_interval_at_the_peak_contains_the_truth(fits: dict[str, MeasuredFit]) -> None:
    low, high = MeasuredResult.of(fits["limits"]).interval(PEAK)
    true = truth(PEAK)
    assert np.mean((low <= true) & (true <= high)) >= 0.85


def test_limit_below_the_fit_changes_nothing(
    tables: tuple[SampleTable, SampleTable], fits: dict[str, MeasuredFit]
) -> None:
    """A limit that the BRDF exceeds anyway is no observation."""
    low = tables[0].select(np.arange(0, len(tables[0]), 50))
    low = replace(
        low,
        photo=np.full(len(low), 6, np.int16),  # of its own: its cells have no other samples
        radiance=np.full_like(low.radiance, 1e-3),
        response=np.zeros_like(low.response),
    )
    found = fit_measured(tables[0], default_basis(), SETTINGS, low)
    change = found.brdf.evaluate(PEAK) / fits["dropped"].brdf.evaluate(PEAK)
    assert np.abs(np.log(change)).max() < 1e-3


def test_limits_do_not_depend_on_how_many_samples_were_kept(
    tables: tuple[SampleTable, SampleTable],
) -> None:
    """Measured samples that are thinned more than clipped ones keep their weight in a cell."""
    measured, clipped = tables
    few = measured.select(np.arange(0, len(measured), 10))
    few = replace(few, weight=np.full(len(few), 10.0, np.float32))
    every, thin = (
        gather(
            SampleTable.concatenate([table, clipped]),
            0.0,
            clipped=np.concatenate([np.zeros((len(table), 3), bool), clipped.response == 0]),
        )
        for table in (measured, few)
    )
    mixed = [cells.clipped[:, 0][(cells.clipped[:, 0] > 0)] for cells in (every, thin)]
    assert np.mean(mixed[0]) == pytest.approx(np.mean(mixed[1]), abs=0.05)


def test_fit_of_clipped_cells_alone_succeeds(tables: tuple[SampleTable, SampleTable]) -> None:
    measured, clipped = tables
    bright = measured.select(np.argsort(-measured.radiance.max(axis=1))[:60])
    fit = fit_measured(bright, default_basis(), SETTINGS, clipped)
    assert np.isfinite(fit.brdf.evaluate(PEAK)).all()


@pytest.mark.slow
def test_fit_job_uses_the_limits(path: Path) -> None:
    job = FitJob(read_capture(path), portable=False)
    job.drain()
    assert job.result is not None
    (material,) = job.result.materials
    ratio = material.fit.brdf.evaluate(PEAK) / truth(PEAK)
    assert (ratio > 0.4).all() and (ratio < 2.5).all()
    assert any("are clipped" in note for note in job.result.notes)
