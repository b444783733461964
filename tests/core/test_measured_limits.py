"""Limits of the measured fit: few, unusual, invalid and very many samples."""

from __future__ import annotations

import json
import tracemalloc
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from patina.core.angles import Angles, half_difference
from patina.core.basis import Basis, default_basis
from patina.core.basis.log_table import LogTable
from patina.core.capture import read_capture
from patina.core.errors import FitError
from patina.core.fit.held_out import HeldOutPhoto, prediction_errors, summarise
from patina.core.fit.measured import MeasuredFit, MeasuredSettings, fit_measured
from patina.core.fit.measured.cell_weights import cells_per_observation
from patina.core.fit.measured.cells import AngleCells, gather
from patina.core.fit.measured.equations import Arrow
from patina.core.fit.measured.forward import CellModel
from patina.core.fit.measured.grazing_prior import extrapolated
from patina.core.fit.measured.normals import refine_normals
from patina.core.fit.measured.patches import Patches
from patina.core.fit.measured.posterior import (
    GAIN_DEVIATION,
    MAX_STEP,
    MEAN_GAIN_DEVIATION,
    _residuals,
    solve,
)
from patina.core.fit.measured.prior import CoefficientPrior
from patina.core.fit.measured_result import MeasuredResult
from patina.core.geometry import RayScene, view_surface
from patina.core.inputs import capture_data
from patina.core.light import MountedLight
from patina.core.noise.basis_error import BASIS_ERROR
from patina.core.samples import SampleTable, sample_photo
from patina.core.samples.take import light_surface
from tests import make_capture as made

FAST_SETTINGS = MeasuredSettings(components=30, rounds=2)
BALL, PLANE = "ball", "plane"


def directions(count: int, seed: int) -> np.ndarray:
    """Unit vectors (count, 3) around +z."""
    v = np.random.default_rng(seed).normal(size=(count, 3)) * [1.0, 1.0, 0.5] + [0, 0, 1.2]
    v[:, 2] = np.abs(v[:, 2]) + 0.1
    return v / np.linalg.norm(v, axis=1, keepdims=True)


def samples(
    count: int,
    photos: int = 3,
    shape: str = BALL,
    flash: bool = False,
    grazing: bool = False,
    rho: tuple[float, float, float] | None = None,
) -> SampleTable:
    """``count`` lit samples of all photos together, of a glossy material of the basis or of a
    Lambertian one; flash: the light is at the camera; grazing: light and view within 15° of the
    surface.
    """
    rng = np.random.default_rng(7)
    n = 40 * count
    photo = rng.integers(0, photos, n)
    view = directions(photos, 1)[photo]
    light = view if flash else directions(photos, 2)[photo]
    if grazing:
        view, light = (
            v / np.linalg.norm(v, axis=1, keepdims=True)
            for v in (view * [1, 1, 0.1], light * [1, 1, 0.1])
        )
    normal = directions(n, 3) if shape == BALL else np.tile([0.0, 0.0, 1.0], (n, 1))
    cos_i, cos_o = (np.sum(normal * v, axis=1) for v in (light, view))
    seen = (cos_i > 0.1) & (cos_o > 0.1)
    if grazing:
        seen = (np.minimum(cos_i, cos_o) > 0.02) & (np.maximum(cos_i, cos_o) < 0.27)
    rows = np.flatnonzero(seen)[:count]
    assert len(rows) == count
    photo = np.sort(photo[rows])
    normal, view, light = (v[rows].astype(np.float32) for v in (normal, view, light))
    angles = half_difference(normal, light, view)
    cos_i, cos_o = cos_i[rows].astype(np.float32), cos_o[rows].astype(np.float32)
    value = truth().evaluate(angles) if rho is None else np.tile(np.float32(rho), (count, 1))
    point = normal if shape == BALL else rng.uniform(-1, 1, (count, 3)) * [1, 1, 0]
    irradiance = np.full((count, 3), np.pi, np.float32)
    return SampleTable(
        photo=photo.astype(np.int16),
        pixel=np.arange(count, dtype=np.int32),
        theta_h=angles.theta_h.astype(np.float32),
        theta_d=angles.theta_d.astype(np.float32),
        phi_d=angles.phi_d.astype(np.float32),
        cos_i=cos_i,
        cos_o=cos_o,
        rho=value,
        radiance=value * irradiance * cos_i[:, None],
        variance=np.zeros((count, 3), np.float32),
        point=point.astype(np.float64),
        normal=normal,
        view=view,
        curvature=np.full(count, np.nan, np.float32),
        light=light,
        irradiance=irradiance,
        weight=np.ones(count, np.float32),
        response=np.ones((count, 3), np.float32),
    )


def truth() -> LogTable:
    c = np.zeros((3, 6))
    c[:, 0], c[:, 1] = 0.04, [0.03, 0.02, 0.01]
    return LogTable.of(default_basis(), c)


def is_finite(fit: MeasuredFit) -> None:
    """Every stored or reported number is finite, and the report can be written."""
    basis = fit.brdf.basis
    nodes = Angles(*(a.ravel()[::97] for a in basis.grid.nodes()))
    rho = fit.brdf.evaluate(nodes)
    assert np.isfinite(rho).all() and (rho >= 0).all()
    kept = MeasuredResult.of(fit)
    assert np.isfinite(kept.band.values).all() and (kept.band.values > 0).all()
    reported = [
        kept.normal_deviation,
        fit.prior_scale,
        *kept.gains.values(),
        *vars(kept.band.spread()).values(),
    ]
    json.dumps([float(x) for x in reported], allow_nan=False)
    for other in fit.without.values():
        assert np.isfinite(other.coefficients).all()


@pytest.mark.parametrize(
    "case",
    [
        {"count": 50, "photos": 1},
        {"count": 50, "photos": 25},
        {"count": 300, "photos": 2},
        {"count": 400, "shape": PLANE},
        {"count": 400, "flash": True},
        {"count": 400, "grazing": True},
        {"count": 400, "rho": (0.0, 0.0, 0.0)},
        {"count": 400, "rho": (0.3, 0.3, 0.3)},
        {"count": 400, "rho": (0.3, 0.0, 0.0)},
        {"count": 400, "rho": (1e6, 1e6, 1e6)},
    ],
    ids=lambda case: " ".join(str(v) for v in case.values()),
)
def test_unusual_captures_give_finite_results(case: dict) -> None:
    table = samples(**case)
    fit = fit_measured(table, default_basis(), FAST_SETTINGS)
    is_finite(fit)
    photos = np.unique(table.photo).tolist()
    assert sorted(fit.without) == (photos if len(photos) > 1 else [])


def test_grey_material_stays_grey() -> None:
    fit = fit_measured(samples(400, rho=(0.3, 0.3, 0.3)), default_basis(), FAST_SETTINGS)
    c = fit.brdf.coefficients
    assert np.allclose(c[0], c[1], atol=1e-5) and np.allclose(c[0], c[2], atol=1e-5)


def test_black_material_stays_black() -> None:
    table = samples(1000, rho=(0.0, 0.0, 0.0))
    fit = fit_measured(table, default_basis(), FAST_SETTINGS)
    assert np.median(fit.brdf.evaluate(table.angles)) < 2e-3


def test_all_samples_at_one_direction() -> None:
    table = samples(200)
    patches = Patches.of_points(np.ones((200, 3)))
    assert patches.count == 1 and patches.neighbours.shape == (1, 1)
    is_finite(fit_measured(replace(table, point=np.ones((200, 3))), default_basis(), FAST_SETTINGS))


def test_invalid_samples_are_ignored() -> None:
    """NaN, infinity and zero light: the result is that of the samples without them."""
    table = samples(600)
    radiance, irradiance, point = (
        np.array(a) for a in (table.radiance, table.irradiance, table.point)
    )
    radiance[3, 1], radiance[17] = np.nan, np.inf
    irradiance[40, 2], irradiance[41] = 0.0, 1e-45
    point[77, 0] = np.nan
    bad = [3, 17, 40, 41, 77]
    broken = replace(table, radiance=radiance, irradiance=irradiance, point=point)
    fit = fit_measured(broken, default_basis(), FAST_SETTINGS)
    expected = fit_measured(
        table.select(np.delete(np.arange(600), bad)), default_basis(), FAST_SETTINGS
    )
    assert fit.samples == 595
    assert fit.brdf.coefficients.tobytes() == expected.brdf.coefficients.tobytes()


def test_too_few_valid_samples_are_rejected() -> None:
    table = samples(60)
    radiance = np.array(table.radiance)
    radiance[:20] = np.nan
    with pytest.raises(FitError, match="40 lit samples"):
        fit_measured(replace(table, radiance=radiance), default_basis(), FAST_SETTINGS)


def test_large_curved_patches_keep_positive_normal_variance() -> None:
    """Patches that see all three axes: the prior's remaining variance does not become negative."""
    table = samples(3000, photos=8)
    octant = (table.normal > 0) @ np.array([1, 2, 4])
    _, of = np.unique(octant, return_inverse=True)
    patches = Patches.of_points(table.point[:60])
    count = int(of.max()) + 1
    few = replace(patches, of=of, count=count, neighbours=0.0 * patches.neighbours[:count, :count])
    found = refine_normals(table, few, truth(), np.radians(1.0), 1e-3)
    assert np.isfinite(found.deviation) and found.deviation > 0
    assert np.isfinite(found.error).all()


def model_of(photos: int, cells: int, basis: Basis) -> CellModel:
    """Cells without a surface: random angles, and radiance with an error of 30 %."""
    rng = np.random.default_rng(5)
    angles = Angles(*(rng.uniform(0, high, cells) for high in (0.6, 0.7, 6.2)))
    return CellModel.of(
        AngleCells(
            np.sort(rng.integers(0, photos, cells)).astype(np.int16),
            rng.integers(1, 40, cells),
            angles,
            np.exp(rng.normal(-2, 0.3, (cells, 3))),
            np.zeros((cells, 3)),
            np.ones(cells),
            np.zeros(cells),
            np.zeros((cells, 3)),
            np.full((cells, 3), np.inf),
        ),
        basis,
    )


def dense_step(
    model: CellModel, prior: CoefficientPrior, start: np.ndarray
) -> tuple[np.ndarray, np.ndarray, dict[int, np.ndarray]]:
    """One Gauss-Newton step with dense (3k + p)² matrices of every photo: (precision, covariance,
    held_out).
    """
    k, (photos, place) = len(prior.mean), np.unique(model.cells.photo, return_inverse=True)
    p, n = len(photos), 3 * k
    prediction = model.predict(start)
    residual, weight = _residuals(model, prediction, np.zeros(len(place)), 0.15)
    weight = weight / cells_per_observation(model.cells)[:, None]
    each, pulls = np.zeros((p, n + p, n + p)), np.zeros((p, n + p))
    for i in range(p):
        own = place == i
        for c in range(3):
            part = slice(c * k, (c + 1) * k)
            w, rows = weight[own, c].astype(np.float32), prediction.jacobian[c][own]
            weighted = rows * w[:, None]
            each[i, part, part] = weighted.T @ rows
            each[i, part, n + i] = each[i, n + i, part] = weighted.sum(axis=0)
            each[i, n + i, n + i] += w.sum()
            pulls[i, part] = weighted.T @ residual[own, c].astype(np.float32)
            pulls[i, n + i] += w @ residual[own, c]
    own_precision = np.zeros((n + p, n + p))
    own_precision[:n, :n] = prior.full_precision()
    own_precision[range(n, n + p), range(n, n + p)] = GAIN_DEVIATION**-2
    mean = np.bincount(place, model.cells.count) / model.cells.count.sum()
    own_precision[n:, n:] += np.outer(mean, mean) / MEAN_GAIN_DEVIATION**2
    total = each.sum(axis=0) + own_precision
    state = np.concatenate([start.ravel(), np.zeros(p)])
    rhs = pulls.sum(axis=0) - own_precision @ state
    rhs[:n] += prior.rhs()
    step = np.linalg.solve(total, rhs)
    size = np.concatenate([np.tile(np.sqrt(prior.variance), 3), np.full(p, GAIN_DEVIATION)])
    state = state + step * min(1.0, MAX_STEP / np.abs(step / size).max())
    full = np.linalg.inv(total)[:n, :n].reshape(3, k, 3, k)
    out = {}
    for i, photo in enumerate(photos.tolist()):
        shift = np.linalg.solve(total - each[i], -pulls[i])
        out[photo] = (state + shift)[:n].reshape(3, k)
    return total, np.stack([full[c, :, c] for c in range(3)]), out


def test_leave_one_photo_out_agrees_with_dense_matrices() -> None:
    basis = default_basis()
    model = model_of(5, 600, basis)
    prior = CoefficientPrior.of(basis, 12)
    prior = prior.with_grazing_prior(extrapolated(model, np.zeros((3, 12))), 1.0)
    start = solve(model, prior, 0.15, None, False, 30).coefficients
    found = solve(model, prior, 0.15, start, True, 1)
    precision, covariance, without = dense_step(model, prior, start)
    assert np.allclose(found.precision.dense(), precision, rtol=1e-8, atol=1e-8)
    assert np.allclose(found.covariance(), covariance, rtol=1e-8, atol=1e-8 * covariance.max())
    size = np.sqrt(basis.coefficient_variance)
    for photo, c in found.without.items():
        # otherwise the test checks nothing
        assert np.abs(c - found.coefficients).max() > 0.05 * size
        assert np.abs(c - without[photo]).max() < 1e-8 * size


@pytest.mark.parametrize("photos", [2, 4])
def test_leave_one_photo_out_approximates_refit_without_photo(photos: int) -> None:
    """Photos that disagree by a tenth: one step moves most of the way to the fit to the other
    photos alone. The rest is due to the weights of cells, which the refit computes anew."""
    basis = default_basis()
    prior = CoefficientPrior.of(basis, 20)
    remaining = []
    for seed in range(4):
        table = samples(4000, photos)
        colour = np.exp(np.random.default_rng(seed).normal(0, 0.1, (photos, 3)))
        radiance = table.radiance * colour.astype(np.float32)[table.photo]
        model = CellModel.of(gather(replace(table, radiance=radiance), 0.0), basis)
        whole = solve(model, prior, BASIS_ERROR, None, True, 60)
        for photo, c in whole.without.items():
            rest = model.select(model.cells.photo != photo)
            alone = solve(rest, prior, BASIS_ERROR, whole.coefficients, False, 60).coefficients
            moved = np.linalg.norm(whole.coefficients - alone)
            remaining.append(np.linalg.norm(c - alone) / moved)
    assert np.median(remaining) < 0.25 and np.max(remaining) < 0.7


def test_arrow_solve_and_marginal_match_dense_matrix() -> None:
    rng = np.random.default_rng(6)
    n, p = 7, 5
    root = rng.normal(size=(n, n))
    arrow = Arrow(
        root @ root.T + 9 * np.eye(n),
        0.5 * rng.normal(size=(n, p)),
        4 + rng.random(p),
        rng.normal(size=p),
    )
    rhs = rng.normal(size=n + p)
    assert np.allclose(arrow.dense() @ arrow.solve(rhs), rhs)
    inverse = np.linalg.inv(arrow.dense())[:n, :n]
    assert np.allclose(np.linalg.inv(arrow.marginal()), inverse)


def test_memory_does_not_grow_with_photo_count() -> None:
    """Dense matrices of 400 photos would take 400 × 490² numbers, 770 MB; the blocks take 10 MB."""
    basis = default_basis()
    prior = CoefficientPrior.of(basis, 30)
    peaks = []
    for photos in (2, 400):
        model = model_of(photos, 1200, basis)
        assert len(basis.nodes)  # allocated before, and not part of the measured memory
        tracemalloc.start()
        found = solve(model, prior, 0.15, iterations=1)
        peaks.append(tracemalloc.get_traced_memory()[1])
        tracemalloc.stop()
        assert len(found.without) == len(np.unique(model.cells.photo))
    assert peaks[1] < peaks[0] + 20e6


def test_cell_count_stays_bounded_for_many_photos() -> None:
    table = samples(20_000, photos=2000)
    cells = gather(table, 0.01)
    assert len(cells) <= 60_000 and cells.count.sum() == 20_000
    assert np.array_equal(np.unique(cells.photo), np.unique(table.photo))


def test_black_photo_has_no_relative_error() -> None:
    """A photo taken with the lens cap on: its error is no fraction of its light and must not hide
    the others.
    """
    table = samples(600)
    dark = table.photo == 1
    radiance = np.where(dark[:, None], np.float32(0), table.radiance)
    table = replace(table, radiance=radiance)
    fit = fit_measured(table, default_basis(), FAST_SETTINGS)
    held = summarise([prediction_errors(table, p, fit.brdf) for p in (0, 1, 2)])
    assert held is not None and sorted(held.per_photo) == [0, 2]
    assert np.isfinite([held.error, held.typical]).all() and held.typical < 1.0
    one = HeldOutPhoto(1, 2.0, 0.0, np.zeros(0), np.zeros(0, np.float32))
    assert summarise([one]) is None


def test_noise_below_black_level_gives_no_infinite_error() -> None:
    """Most of a photo is at or below zero, as in dark raw frames: no relative error becomes
    infinite.
    """
    table = samples(400, photos=1)
    radiance = np.full_like(table.radiance, -1e-3)
    radiance[:100] = 0.0
    radiance[100:180] = table.radiance[100:180]
    found = prediction_errors(
        replace(table, radiance=radiance),
        0,
        fit_measured(table, default_basis(), FAST_SETTINGS).brdf,
    )
    assert np.isfinite(found.relative).all() and (found.relative >= 0).all()
    assert len(found.relative) == 80


def test_pixels_outside_narrow_beam_are_excluded(tmp_path: Path) -> None:
    """A torch lights the middle of a photo that is black elsewhere: 0/0 is no reflectance."""
    capture = read_capture(made.make_capture(tmp_path))
    scan = capture_data.open_scan(capture)
    camera, rays = capture_data.camera_of(capture, scan, 0), RayScene.build(scan.mesh)
    view = view_surface(rays, camera)
    torch = MountedLight("torch", np.zeros(3), np.full(3, 50.0), beam=np.radians(1.0))
    lighting = light_surface(rays, view, torch, camera)
    black = np.zeros((camera.height, camera.width, 3), np.float32)
    lit = lighting.cos_i > 0.1
    with np.errstate(all="raise", under="ignore"):
        table = sample_photo(view, lighting, black, lit)
    assert 0 < len(table) < lit.sum()
    assert np.isfinite(table.rho).all()
    towards = (view.point - camera.pose.centre) @ camera.pose.rotation[2]
    angle = np.arccos(towards / np.linalg.norm(view.point - camera.pose.centre, axis=1))
    assert np.isin(view.pixel[lit & (angle < np.radians(5))], table.pixel).all()
