"""Patina's own estimator: its parts against mathematics, the whole against a known material."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from patina.core.angles import Angles, cosines, half_difference
from patina.core.basis import Basis, default_basis, mapping
from patina.core.basis.log_table import LogTable
from patina.core.errors import FitError
from patina.core.fit.measured import MeasuredSettings, fit_measured
from patina.core.fit.measured.cells import gather
from patina.core.fit.measured.forward import CellModel, CellNodes
from patina.core.fit.measured.grazing_prior import GrazingPrior, directions
from patina.core.fit.measured.lobes import Lobes, fit_lobes
from patina.core.fit.measured.normal_quadrature import quadrature_angles, rings
from patina.core.fit.measured.normals import refine_normals, with_normals
from patina.core.fit.measured.patches import Patches
from patina.core.fit.measured.posterior import solve
from patina.core.fit.measured.prior import CoefficientPrior
from patina.core.fit.measured.prior_scale import MIN_SCALE, solve_with_scale
from patina.core.fit.measured.shrinkage import SHRINKAGE, shrinkage_step
from patina.core.samples import SampleTable
from tests import make_capture as made
from tests.sampled import sampled


@pytest.fixture(scope="module")
def table(tmp_path_factory: pytest.TempPathFactory) -> SampleTable:
    return sampled(made.make_capture(tmp_path_factory.mktemp("ball")))[0]


def test_normal_quadrature_integrates_planar_gaussian() -> None:
    offsets, weights = rings()
    r2 = np.sum(offsets**2, axis=1)
    assert weights.sum() == pytest.approx(1.0)
    assert np.abs(weights @ offsets).max() < 1e-12
    for power, moment in ((1, 2.0), (2, 8.0), (3, 48.0), (4, 384.0)):  # E r^2p of a planar Gaussian
        assert weights @ r2**power == pytest.approx(moment, rel=1e-9)


def test_zero_normal_spread_gives_the_direction_itself() -> None:
    angles = Angles(np.array([0.1, 0.5]), np.array([0.3, 0.9]), np.array([1.0, 2.0]))
    seen, cos_i, cos_o, weights = quadrature_angles(angles, np.zeros(2))
    assert np.allclose(np.stack(seen)[..., 0], np.stack(angles))
    own_i, own_o = cosines(*angles)
    assert np.allclose(cos_i[:, 0], own_i) and np.allclose(cos_o[:, 0], own_o)
    assert weights.tolist() == [1.0]


def test_cells_keep_sample_count_and_mean_light(table: SampleTable) -> None:
    cells = gather(table, 0.0)
    assert cells.count.sum() == len(table)
    light = (table.radiance / table.irradiance).sum(axis=0)
    assert np.allclose((cells.reflected * cells.count[:, None]).sum(axis=0), light, rtol=0.01)


def test_jacobian_matches_finite_differences_of_prediction(table: SampleTable) -> None:
    basis = default_basis()
    cells = gather(table, np.radians(1.0)).select(np.arange(0, 400))
    model = CellModel.of(cells, basis)
    k = 12
    c = 0.03 * np.random.default_rng(0).standard_normal((3, k))
    jacobian = model.predict(c).jacobian
    for component in (0, 5, 11):
        step = np.zeros((3, k))
        step[:, component] = 1e-3
        up, down = model.predict(c + step, jacobian=False), model.predict(c - step, jacobian=False)
        numeric = np.log(up.level / down.level) / 2e-3
        for channel in range(3):
            difference = jacobian[channel][:, component] - numeric[:, channel]
            assert np.abs(difference).max() < 2e-2 * max(1.0, np.abs(numeric).max())


def test_model_subset_predicts_like_full_model(table: SampleTable) -> None:
    model = CellModel.of(gather(table, np.radians(0.5)), default_basis())
    c = 0.02 * np.random.default_rng(1).standard_normal((3, 8))
    some = np.random.default_rng(2).random(len(model.cells)) < 0.4
    whole, part = model.predict(c), model.select(some).predict(c)
    assert np.allclose(part.level, whole.level[some], rtol=1e-5)
    assert np.allclose(part.jacobian[1], whole.jacobian[1][some], rtol=1e-4, atol=1e-5)


def test_prior_has_mean_and_covariance_of_all_measured_materials() -> None:
    """Materials drawn from the prior are spread as the measured ones are; those of the basis are as
    likely as it says."""
    basis = default_basis()
    assert basis.training is not None and basis.others is not None
    known = np.concatenate([basis.training, basis.others])
    prior = CoefficientPrior.of(basis, basis.count)
    covariance = np.linalg.inv(prior.precision)
    direction = np.random.default_rng(3).normal(size=basis.count)
    along = known @ direction
    assert prior.mean @ direction == pytest.approx(along.mean(), abs=1e-9)
    assert direction @ covariance @ direction == pytest.approx(along.var(), rel=0.1)
    whole = prior.full_precision()
    k = basis.count
    assert np.allclose(whole[k : 2 * k, k : 2 * k], prior.precision)
    assert not whole[:k, k:].any()
    assert np.allclose(np.linalg.solve(whole, prior.rhs()), np.tile(prior.mean, 3), atol=1e-9)
    each = [prior.mean_square(known[i : i + 3]) for i in range(0, len(known), 3)]
    # the added variance makes them a little more likely than their own covariance
    assert np.mean(each) == pytest.approx(0.9, abs=0.1)


def test_prior_of_a_database_alone_is_that_of_its_components() -> None:
    """Without other materials, coefficients are independent with variance 1/columns."""
    basis = replace(default_basis(), others=None)
    prior = CoefficientPrior.of(basis, 12)
    assert np.allclose(prior.precision, basis.columns * np.eye(12))
    assert not prior.mean.any()


def test_grazing_prior_continues_change_of_lobes() -> None:
    """A BRDF that equals the lobes up to the edge continues halfway between its edge value and the
    lobes.
    """
    basis = default_basis()
    lobes = Lobes(np.log([0.1] * 3 + [0.3, 1.0] + [0.05] * 3 + [0.1, 1.0] + [1e-6] * 3), 0.0)
    k = basis.count
    grid = Angles(*(a.ravel() for a in basis.grid.nodes()))
    as_lobes = basis.project(lobes.evaluate(grid), grid, k, 0.3)
    edge = np.radians(60.0)
    grazing = GrazingPrior.of(lobes, basis, as_lobes, edge)
    prior = CoefficientPrior.of(basis, k).with_grazing_prior(grazing, 0.05)
    c = np.linalg.solve(prior.full_precision(), prior.rhs()).reshape(3, k)
    angles = directions(edge)
    at_edge = Angles(angles.theta_h, np.full_like(angles.theta_d, edge), angles.phi_d)

    def logs(rho: np.ndarray, where: Angles) -> np.ndarray:
        return mapping.log_weighted(np.asarray(rho, float), mapping.cos_map(where))

    expected = (logs(lobes.evaluate(at_edge), at_edge) + logs(lobes.evaluate(angles), angles)) / 2
    off = np.abs(logs(basis.evaluate(c, angles), angles) - expected).mean()
    mean = np.abs(logs(basis.evaluate(0 * c, angles), angles) - expected).mean()
    assert off < 0.35 * mean


def test_lobe_fit_recovers_lambertian_surface(table: SampleTable) -> None:
    grey = np.array([0.3, 0.2, 0.1])
    light = table.irradiance * table.cos_i[:, None] * grey.astype(np.float32)
    cells = gather(replace(table, radiance=light), 0.0)
    lobes = fit_lobes(cells)
    rho = lobes.evaluate(Angles(*(np.array([x]) for x in (0.3, 0.4, 1.0))))
    assert np.allclose(rho[0], grey, rtol=0.05) and lobes.misfit < 0.02


def test_smooth_normal_errors_are_recovered(table: SampleTable) -> None:
    """A glossy material, normals tilted smoothly by two degrees: most of the tilt is recovered."""
    basis = default_basis()
    truth = made_brdf(basis)
    radiance = truth.evaluate(table.angles) * table.irradiance * table.cos_i[:, None]
    clean = replace(table, radiance=radiance.astype(np.float32))
    p = clean.point / np.ptp(clean.point, axis=0).max()
    tilt = np.radians(2.0) * np.stack([np.sin(9 * p[:, 1]), np.cos(7 * p[:, 2]), 0 * p[:, 0]], 1)
    true = clean.normal.astype(np.float64)
    wrong = true + tilt - np.sum(tilt * true, axis=1, keepdims=True) * true
    wrong /= np.linalg.norm(wrong, axis=1, keepdims=True)
    scanned = with_normals(clean, wrong)
    patches = Patches.of_points(scanned.point)
    found = refine_normals(scanned, patches, truth, np.radians(1.5))

    def typical(normal: np.ndarray) -> float:
        return float(np.median(np.linalg.norm(normal - true, axis=1)))

    # one photo fixes one of the two directions of a normal, and neither of them away from
    # highlights
    assert typical(found.table.normal) < 0.75 * typical(wrong)
    assert np.isfinite(found.error).all() and (found.error >= 0).all()


def test_diffuse_material_leaves_normals_unchanged(table: SampleTable) -> None:
    basis = default_basis()
    nodes = Angles(*(a.ravel() for a in basis.grid.nodes()))
    cos_i, cos_o = cosines(*nodes)
    flat = np.log(0.1 * np.clip(cos_i * cos_o, 0.01, 1.0) + 1e-3)
    matte = LogTable(basis.grid, np.repeat(flat[:, None], 3, axis=1).astype(np.float32))
    shown = matte.evaluate(table.angles) * table.irradiance * table.cos_i[:, None]
    clean = replace(table, radiance=shown.astype(np.float32))
    found = refine_normals(clean, Patches.of_points(clean.point), matte, np.radians(1.0))
    angle = np.linalg.norm(found.table.normal - clean.normal, axis=1)
    assert np.median(angle) < np.radians(0.2)


def test_full_fit_recovers_known_material(table: SampleTable) -> None:
    basis = default_basis()
    truth = made_brdf(basis)
    shown = truth.evaluate(table.angles) * table.irradiance * table.cos_i[:, None]
    fit = fit_measured(replace(table, radiance=shown.astype(np.float32)), basis)
    some = np.random.default_rng(4).choice(len(table), 2000, replace=False)
    angles = Angles(*(a[some] for a in table.angles))
    error = np.log(fit.brdf.evaluate(angles) / truth.evaluate(angles))
    assert np.median(np.abs(error)) < 0.03
    band = fit.band(angles)
    assert band.shape == (2000, 3) and (band > 0).all()
    unobserved = Angles(*(np.array([np.radians(x)]) for x in (1.0, 82.0, 90.0)))
    assert fit.band(unobserved).min() > np.median(band)


def test_same_input_gives_identical_bytes(table: SampleTable) -> None:
    quick = MeasuredSettings(rounds=1, components=20)
    first, second = (fit_measured(table, default_basis(), quick) for _ in range(2))
    assert first.brdf.coefficients.tobytes() == second.brdf.coefficients.tobytes()


def test_too_few_samples_are_rejected(table: SampleTable) -> None:
    with pytest.raises(FitError, match="at least"):
        fit_measured(table.select(np.arange(10)), default_basis())


def test_patch_laplacian_rows_sum_to_zero(table: SampleTable) -> None:
    patches = Patches.of_points(table.point)
    assert patches.of.shape == (len(table),)
    assert np.abs(patches.neighbours.sum(axis=1)).max() < 1e-9
    assert 2.0 < len(table) / patches.count < 20.0


def test_recomputed_angles_agree_with_sampling(table: SampleTable) -> None:
    again = with_normals(table, table.normal.astype(np.float64))
    expected = half_difference(table.normal, table.light, table.view)
    assert np.allclose(again.theta_h, expected.theta_h, atol=1e-6)
    assert np.allclose(again.rho, table.rho, rtol=1e-3)


def made_brdf(basis: Basis) -> LogTable:
    """A glossy material of the basis: its mean shifted along the gloss component."""
    c = np.zeros((3, 6))
    c[:, 0] = 0.04
    c[:, 1] = [0.03, 0.02, 0.01]
    return LogTable.of(basis, c)


def test_log_table_matches_basis(table: SampleTable) -> None:
    basis = default_basis()
    c = 0.03 * np.random.default_rng(5).standard_normal((3, 10))
    angles = Angles(*(a[:500] for a in table.angles))
    assert np.allclose(
        LogTable.of(basis, c).evaluate(angles), basis.evaluate(c, angles), rtol=2e-3, atol=1e-6
    )


def test_scale_of_prior_tells_unlikely_material(table: SampleTable) -> None:
    """A lobe that no measured material has: the prior is widened, and the fit follows the samples;
    with the prior as it is, it does not reach them. A likely material leaves it as it is."""
    basis = default_basis()
    prior = CoefficientPrior.of(basis, basis.count)
    likely = made_brdf(basis).evaluate(table.angles)
    odd = likely * (1 + 20 * np.exp(-np.square((table.theta_h - 0.35) / 0.05))[:, None])
    scales, off = [], []
    for rho in (likely, odd):
        light = rho * table.irradiance * table.cos_i[:, None]
        cells = gather(replace(table, radiance=light.astype(np.float32)), 0.0)
        model = CellModel.of(cells, basis)
        found, scale = solve_with_scale(model, prior, 0.15)
        plain = solve(model, prior, 0.15, leave_out=False)
        scales.append(scale)
        off.append(
            [
                float(np.std(np.log(model.predict(c, False).level / model.observed)))
                for c in (found.coefficients, plain.coefficients)
            ]
        )
    assert scales[0] == MIN_SCALE and scales[1] > 1.5
    assert off[0][0] < 0.05 and off[1][0] < 0.9 * off[1][1]


def test_shrinkage_darkens_only_uncertain_directions() -> None:
    """One component is unknown: the BRDF decreases only where that component matters."""
    basis = default_basis()
    k = basis.count
    covariance = np.tile(1e-8 * np.eye(k), (3, 1, 1))
    covariance[:, 2, 2] = basis.coefficient_variance
    change = basis.nodes[:, 1 : 1 + k] @ shrinkage_step(basis, covariance)[0]
    variance = basis.coefficient_variance * basis.nodes[:, 3].astype(np.float64) ** 2
    cos_i, cos_o = cosines(*(Angles(*(a.ravel() for a in basis.grid.nodes()))))
    seen = np.minimum(cos_i, cos_o) > 0.05
    uncertain, certain = seen & (variance > 0.2), seen & (variance < 0.002)
    assert change[uncertain].mean() < -0.6 * SHRINKAGE * np.minimum(variance, 1.5)[uncertain].mean()
    assert abs(change[certain].mean()) < 0.02


def test_distinct_nodes_of_each_cell_with_their_sums() -> None:
    rng = np.random.default_rng(1)
    normals = 3
    index = rng.integers(0, 9, (40, 8 * normals)).astype(np.int32)
    weight = rng.random(index.shape, np.float32)
    pairs = CellNodes.of(index, weight)
    values = rng.random((40, normals))
    some = rng.random(40) < 0.5
    for found, rows in ((pairs, np.arange(40)), (pairs.select(some), np.flatnonzero(some))):
        sums = found.sums @ values[rows].ravel()
        for i, row in enumerate(rows):
            own = slice(found.indptr[i], found.indptr[i + 1])
            assert np.array_equal(found.node[own], np.unique(index[row]))
            each = weight[row] * np.repeat(values[row], 8)
            assert np.allclose(sums[own], np.bincount(index[row], each)[found.node[own]])
