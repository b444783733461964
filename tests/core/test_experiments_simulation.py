"""Simulated captures and error measures, compared with independently known values."""

from __future__ import annotations

import numpy as np
import pytest

from patina.core.angles import Angles, cosines, merl_grid
from patina.core.basis import PrincipalBRDF, default_basis
from patina.core.brdf import TabulatedBRDF
from patina.core.brdf import metrics as core_metrics
from patina.core.light import DistantLight
from patina.core.scan import Camera, Mesh
from patina.core.scan.camera import Pose
from tools.experiments import estimators, mesh_error, metrics, scenes, simulate, spheres


def sphere(rings: int = 120) -> Mesh:
    """A unit sphere, triangulated along circles of latitude."""
    theta = np.linspace(0, np.pi, rings + 1)
    phi = np.arange(2 * rings) * np.pi / rings
    t, p = np.meshgrid(theta, phi, indexing="ij")
    points = np.stack([np.sin(t) * np.cos(p), np.sin(t) * np.sin(p), np.cos(t)], -1)
    i, j = np.meshgrid(np.arange(rings), np.arange(2 * rings), indexing="ij")
    vertex_index = lambda a, b: a * 2 * rings + b % (2 * rings)  # noqa: E731
    quads = np.stack(
        [
            vertex_index(i, j),
            vertex_index(i + 1, j),
            vertex_index(i + 1, j + 1),
            vertex_index(i, j + 1),
        ],
        -1,
    ).reshape(-1, 4)
    faces = np.concatenate([quads[:, [0, 1, 2]], quads[:, [0, 2, 3]]])
    positions = points.reshape(-1, 3)
    edges = positions[np.roll(faces, 1, axis=1)] - positions[faces]
    return Mesh(
        positions, faces[(np.linalg.norm(edges, axis=2) > 1e-9).all(axis=1)].astype(np.int32)
    )


def camera(width: int = 120, height: int = 100) -> Camera:
    """A camera at distance 5 that looks along +z at the origin."""
    return Camera(
        "one", width, height, "PINHOLE", (190.0, 190.0, width / 2, height / 2),
        Pose(np.eye(3), np.array([0.0, 0.0, 5.0])),
    )  # fmt: skip


def lamp(*direction: float) -> DistantLight:
    d = np.array(direction)
    return DistantLight("lamp", d / np.linalg.norm(d), np.array([2.0, 3.0, 4.0]))


def diffuse(angles: Angles) -> np.ndarray:
    return np.full((len(angles.theta_h), 3), 0.2, np.float32)


@pytest.fixture(scope="module")
def simulated_samples() -> simulate.Sampled:
    ball = sphere()
    return simulate.sample_scanned(ball, ball, [simulate.Shot(camera(), lamp(1, -0.5, -1))])


def test_diffuse_ball_follows_lamberts_law(simulated_samples: simulate.Sampled) -> None:
    table = simulated_samples.photograph(diffuse, None)
    assert len(table) > 1000
    point = table.normal  # position on a unit sphere around the origin
    cosine = point @ lamp(1, -0.5, -1).direction
    expected = 0.2 * np.array([2.0, 3.0, 4.0]) * cosine[:, None]
    np.testing.assert_allclose(table.radiance, expected, rtol=0.02)
    np.testing.assert_allclose(np.median(table.rho, axis=0), 0.2, rtol=1e-3)


def test_specular_peak_lies_at_the_half_vector(simulated_samples: simulate.Sampled) -> None:
    narrow_lobe = lambda a: np.exp(-((a.theta_h / 0.05) ** 2))[:, None].repeat(3, axis=1)  # noqa: E731
    table = simulated_samples.photograph(narrow_lobe, None)
    brightest = table.rho[:, 0].argmax()
    half = lamp(1, -0.5, -1).direction + table.view[brightest]
    assert table.normal[brightest] @ (half / np.linalg.norm(half)) > np.cos(np.radians(1.5))


def test_cast_shadow_is_black() -> None:
    ball = sphere(60)
    floor = np.array([[-9, 1.2, -9], [9, 1.2, -9], [9, 1.2, 9], [-9, 1.2, 9]], float)
    faces = np.array([[0, 1, 2], [0, 2, 3]]) + len(ball.vertices)
    ball_and_floor = Mesh(
        np.concatenate([ball.vertices, floor]), np.concatenate([ball.faces, faces]).astype(np.int32)
    )
    shot = simulate.Shot(camera(), lamp(0.3, -1, -0.2))
    seen = simulate.sample_scanned(ball_and_floor, ball_and_floor, [shot], trusted=False)
    without_floor = simulate.sample_scanned(ball, ball_and_floor, [shot], trusted=False)
    pixels = simulate.true_pixels(simulate.RayScene.build(ball_and_floor), shot)
    lit = (pixels.shading > 0).mean()
    assert 0.05 < lit < (pixels.hit > 0).mean() - 0.02
    assert (seen.true.shading.mean(axis=1) > 0).mean() > 0.95
    assert (without_floor.true.hit == 0).any()  # without the floor, its pixels hit nothing
    assert (
        without_floor.photograph(diffuse, None).radiance[without_floor.true.hit == 0] == 0
    ).all()


def test_noise_matches_the_camera_model(simulated_samples: simulate.Sampled) -> None:
    clean = simulated_samples.photograph(diffuse, None).radiance.astype(float)
    noisy = np.array(
        [simulated_samples.photograph(diffuse, seed).radiance for seed in range(60)], float
    )
    white = np.percentile(clean, simulate.WHITE)
    electrons = clean / white * simulate.FULL_WELL
    expected = np.sqrt(electrons + simulate.READ_NOISE**2) * white / simulate.FULL_WELL
    ratio = noisy.std(axis=0, ddof=1) / expected
    assert abs(ratio.mean() - 1) < 0.01
    np.testing.assert_allclose(noisy.mean(axis=0), clean, atol=6 * expected.max() / np.sqrt(60))
    repeated = simulated_samples.photograph(diffuse, 7)
    np.testing.assert_array_equal(repeated.rho, simulated_samples.photograph(diffuse, 7).rho)


@pytest.mark.parametrize("kind", ["bumpy", "wavy", "blurred"])
@pytest.mark.parametrize("degrees", [1.0, 5.0])
def test_normal_errors_have_the_requested_size(kind: str, degrees: float) -> None:
    rng = np.random.default_rng(0)
    true = sphere(70)
    true = Mesh(true.vertices * (1 + 0.02 * rng.random((len(true.vertices), 1))), true.faces)
    scanned = mesh_error.make(kind)(true, degrees, 1)
    dot = np.einsum("ij,ij->i", scanned.vertex_normals, true.vertex_normals)
    found = np.median(np.degrees(np.arccos(np.clip(dot, -1, 1))))
    assert found == pytest.approx(degrees, rel=0.25)


def test_lights_have_the_requested_angle_to_the_view() -> None:
    for shot, degrees in zip(scenes.rig(1, 8, scenes.ORDER), scenes.ORDER * 2, strict=True):
        view = shot.camera.pose.centre - scenes.shapes.CENTRE
        cosine = view @ shot.light.direction / np.linalg.norm(view)
        assert np.degrees(np.arccos(cosine)) == pytest.approx(degrees, abs=1e-6)
        projected_centre = shot.camera.project(scenes.shapes.CENTRE[None])[0]
        np.testing.assert_allclose(projected_centre, np.array(scenes.SIZE) / 2, atol=1e-6)


def glossy(angles: Angles) -> np.ndarray:
    lobe = 3.0 * np.exp(-((angles.theta_h / 0.15) ** 2))
    return np.stack([0.05 + lobe, 0.08 + lobe, 0.02 + lobe], axis=-1)


def test_error_measures_of_a_constant_factor() -> None:
    found = metrics.errors(lambda a: 1.2 * glossy(a), glossy)
    for value in (found.relative_l2, found.specular_l2):
        assert value == pytest.approx(0.2, rel=1e-6)
    assert found.peak == pytest.approx(1.2, rel=1e-3)
    assert found.peaks == pytest.approx((1.2, 1.2, 1.2), rel=1e-3)
    # the offset ε reduces the log error slightly
    assert 0.9 * np.log(1.2) < found.log_rms < np.log(1.2)


def test_error_measures_agree_with_core_metrics() -> None:
    fit = lambda a: glossy(a) * (1 + 0.3 * np.cos(a.theta_d))[:, None]  # noqa: E731
    tables = [TabulatedBRDF.from_function(f) for f in (fit, glossy)]
    expected = core_metrics.compare(*tables)
    for every in (1, 3):
        found = metrics.errors(fit, glossy, every=every)
        assert found.log_rms == pytest.approx(expected.log_relative_rms, rel=2e-3)
        assert found.cube_root == pytest.approx(expected.cube_root_rms, rel=2e-3)
        assert found.relative_l2 == pytest.approx(expected.relative_l2, rel=5e-3)


def test_covered_cells_are_those_with_a_sample(simulated_samples: simulate.Sampled) -> None:
    seen = metrics.covered(simulated_samples.table, every=1)
    cells = np.stack(merl_grid.index(simulated_samples.table.angles))
    inside = merl_grid.visible(Angles(*(a[tuple(cells)] for a in merl_grid.node_angles(0.5))))
    assert seen.sum() == len(np.unique(cells[:, inside], axis=1).T)


def test_all_samples_estimator_recovers_a_brdf_of_the_basis(
    simulated_samples: simulate.Sampled,
) -> None:
    basis = default_basis()
    c = np.random.default_rng(2).normal(0, 0.04, (3, 5))
    truth = PrincipalBRDF(basis, c)
    sample_angles = simulated_samples.table.angles
    rho = truth.evaluate(sample_angles)
    table = simulated_samples.exposed(rho * simulated_samples.table.cos_i[:, None], None)
    fit = estimators.all_samples(5, eta=1e-6)(table, basis, 0)
    np.testing.assert_allclose(fit.evaluate(sample_angles), rho, rtol=2e-3, atol=1e-4)


def test_white_ball_under_a_uniform_sky() -> None:
    q = spheres.quadrature()
    uniform_sky = np.bincount(q.pixel, q.weight, q.pixels)
    np.testing.assert_allclose(uniform_sky, np.pi, rtol=0.02)  # ∫ cos dω over the hemisphere
    height = np.cos(np.pi * (np.arange(spheres.ROWS) + 0.5) / spheres.ROWS)
    sky = np.maximum(height, 0).repeat(spheres.COLUMNS)  # brightest at the zenith
    lit = np.bincount(q.pixel, q.weight * sky[q.cell], q.pixels)
    top, bottom = lit[: q.pixels // 20].max(), lit[-q.pixels // 20 :].min()
    # ∫ cos² dω for a normal close to the zenith
    assert top == pytest.approx(2 * np.pi / 3, rel=0.05)
    assert bottom < 0.01 * top
    cos_i, cos_o = cosines(*q.angles)
    assert min(cos_i.min(), cos_o.min()) > 0


def test_psnr_of_known_errors() -> None:
    truth = np.linspace(0.2, 0.8, 300, dtype=np.float32).reshape(1, 100, 3)
    assert spheres.psnr(truth, truth)[0] == pytest.approx(60.0)
    assert spheres.psnr(0 * truth, truth)[0] < 6
    small_error, large_error = (spheres.psnr(truth * f, truth)[0] for f in (0.99, 0.9))
    assert small_error > large_error + 15  # a tenth of the error gives 20 dB more, up to rounding
