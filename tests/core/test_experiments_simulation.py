"""The simulated captures and the figures they are judged by, against answers known without them."""

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
    """A unit sphere of latitude rings."""
    theta = np.linspace(0, np.pi, rings + 1)
    phi = np.arange(2 * rings) * np.pi / rings
    t, p = np.meshgrid(theta, phi, indexing="ij")
    points = np.stack([np.sin(t) * np.cos(p), np.sin(t) * np.sin(p), np.cos(t)], -1)
    i, j = np.meshgrid(np.arange(rings), np.arange(2 * rings), indexing="ij")
    at = lambda a, b: a * 2 * rings + b % (2 * rings)  # noqa: E731
    quads = np.stack([at(i, j), at(i + 1, j), at(i + 1, j + 1), at(i, j + 1)], -1).reshape(-1, 4)
    faces = np.concatenate([quads[:, [0, 1, 2]], quads[:, [0, 2, 3]]])
    places = points.reshape(-1, 3)
    sides = places[np.roll(faces, 1, axis=1)] - places[faces]
    return Mesh(places, faces[(np.linalg.norm(sides, axis=2) > 1e-9).all(axis=1)].astype(np.int32))


def camera(width: int = 120, height: int = 100) -> Camera:
    """Looks along +z at the origin from a distance of 5."""
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
def taken() -> simulate.Sampled:
    ball = sphere()
    return simulate.sample_scanned(ball, ball, [simulate.Shot(camera(), lamp(1, -0.5, -1))])


def test_a_diffuse_ball_shines_as_lambert_says(taken: simulate.Sampled) -> None:
    table = taken.photograph(diffuse, None)
    assert len(table) > 1000
    point = table.normal  # of a unit ball around the origin
    cosine = point @ lamp(1, -0.5, -1).direction
    expected = 0.2 * np.array([2.0, 3.0, 4.0]) * cosine[:, None]
    np.testing.assert_allclose(table.radiance, expected, rtol=0.02)
    np.testing.assert_allclose(np.median(table.rho, axis=0), 0.2, rtol=1e-3)


def test_a_mirrored_lobe_stands_where_the_half_vector_does(taken: simulate.Sampled) -> None:
    narrow = lambda a: np.exp(-((a.theta_h / 0.05) ** 2))[:, None].repeat(3, axis=1)  # noqa: E731
    table = taken.photograph(narrow, None)
    brightest = table.rho[:, 0].argmax()
    half = lamp(1, -0.5, -1).direction + table.view[brightest]
    assert table.normal[brightest] @ (half / np.linalg.norm(half)) > np.cos(np.radians(1.5))


def test_cast_shadow_is_black() -> None:
    ball = sphere(60)
    floor = np.array([[-9, 1.2, -9], [9, 1.2, -9], [9, 1.2, 9], [-9, 1.2, 9]], float)
    faces = np.array([[0, 1, 2], [0, 2, 3]]) + len(ball.vertices)
    both = Mesh(
        np.concatenate([ball.vertices, floor]), np.concatenate([ball.faces, faces]).astype(np.int32)
    )
    shot = simulate.Shot(camera(), lamp(0.3, -1, -0.2))
    seen = simulate.sample_scanned(both, both, [shot], trusted=False)
    without = simulate.sample_scanned(ball, both, [shot], trusted=False)
    pixels = simulate.true_pixels(simulate.RayScene.build(both), shot)
    lit = (pixels.shading > 0).mean()
    assert 0.05 < lit < (pixels.hit > 0).mean() - 0.02
    assert (seen.true.shading.mean(axis=1) > 0).mean() > 0.95
    assert (without.true.hit == 0).any()  # the floor is not there: those rows see nothing
    assert (without.photograph(diffuse, None).radiance[without.true.hit == 0] == 0).all()


def test_noise_is_that_of_the_camera_described(taken: simulate.Sampled) -> None:
    clean = taken.photograph(diffuse, None).radiance.astype(float)
    noisy = np.array([taken.photograph(diffuse, seed).radiance for seed in range(60)], float)
    white = np.percentile(clean, simulate.WHITE)
    electrons = clean / white * simulate.FULL_WELL
    expected = np.sqrt(electrons + simulate.READ_NOISE**2) * white / simulate.FULL_WELL
    ratio = noisy.std(axis=0, ddof=1) / expected
    assert abs(ratio.mean() - 1) < 0.01
    np.testing.assert_allclose(noisy.mean(axis=0), clean, atol=6 * expected.max() / np.sqrt(60))
    again = taken.photograph(diffuse, 7)
    np.testing.assert_array_equal(again.rho, taken.photograph(diffuse, 7).rho)


@pytest.mark.parametrize("kind", ["bumpy", "wavy", "blurred"])
@pytest.mark.parametrize("degrees", [1.0, 5.0])
def test_normals_are_off_by_what_was_asked(kind: str, degrees: float) -> None:
    rng = np.random.default_rng(0)
    true = sphere(70)
    true = Mesh(true.vertices * (1 + 0.02 * rng.random((len(true.vertices), 1))), true.faces)
    scanned = mesh_error.make(kind)(true, degrees, 1)
    dot = np.einsum("ij,ij->i", scanned.vertex_normals, true.vertex_normals)
    found = np.median(np.degrees(np.arccos(np.clip(dot, -1, 1))))
    assert found == pytest.approx(degrees, rel=0.25)


def test_lights_stand_at_their_angle_from_the_view() -> None:
    for shot, degrees in zip(scenes.rig(1, 8, scenes.ORDER), scenes.ORDER * 2, strict=True):
        view = shot.camera.pose.centre - scenes.shapes.CENTRE
        cosine = view @ shot.light.direction / np.linalg.norm(view)
        assert np.degrees(np.arccos(cosine)) == pytest.approx(degrees, abs=1e-6)
        middle = shot.camera.project(scenes.shapes.CENTRE[None])[0]
        np.testing.assert_allclose(middle, np.array(scenes.SIZE) / 2, atol=1e-6)


def glossy(angles: Angles) -> np.ndarray:
    lobe = 3.0 * np.exp(-((angles.theta_h / 0.15) ** 2))
    return np.stack([0.05 + lobe, 0.08 + lobe, 0.02 + lobe], axis=-1)


def test_a_constant_factor_is_what_every_figure_says() -> None:
    found = metrics.errors(lambda a: 1.2 * glossy(a), glossy)
    for value in (found.relative_l2, found.specular_l2):
        assert value == pytest.approx(0.2, rel=1e-6)
    assert found.peak == pytest.approx(1.2, rel=1e-3)
    assert found.peaks == pytest.approx((1.2, 1.2, 1.2), rel=1e-3)
    assert 0.9 * np.log(1.2) < found.log_rms < np.log(1.2)  # ε takes a little


def test_figures_agree_with_the_programs_own() -> None:
    fit = lambda a: glossy(a) * (1 + 0.3 * np.cos(a.theta_d))[:, None]  # noqa: E731
    tables = [TabulatedBRDF.from_function(f) for f in (fit, glossy)]
    expected = core_metrics.compare(*tables)
    for every in (1, 3):
        found = metrics.errors(fit, glossy, every=every)
        assert found.log_rms == pytest.approx(expected.log_relative_rms, rel=2e-3)
        assert found.cube_root == pytest.approx(expected.cube_root_rms, rel=2e-3)
        assert found.relative_l2 == pytest.approx(expected.relative_l2, rel=5e-3)


def test_covered_cells_are_those_that_hold_a_sample(taken: simulate.Sampled) -> None:
    seen = metrics.covered(taken.table, every=1)
    cells = np.stack(merl_grid.index(taken.table.angles))
    inside = merl_grid.visible(Angles(*(a[tuple(cells)] for a in merl_grid.node_angles(0.5))))
    assert seen.sum() == len(np.unique(cells[:, inside], axis=1).T)


def test_all_samples_find_a_brdf_of_the_span(taken: simulate.Sampled) -> None:
    basis = default_basis()
    c = np.random.default_rng(2).normal(0, 0.04, (3, 5))
    truth = PrincipalBRDF(basis, c)
    exact = taken.table.angles
    rho = truth.evaluate(exact)
    table = taken.exposed(rho * taken.table.cos_i[:, None], None)
    fit = estimators.all_samples(5, eta=1e-6)(table, basis, 0)
    np.testing.assert_allclose(fit.evaluate(exact), rho, rtol=2e-3, atol=1e-4)


def test_a_white_ball_under_an_even_sky() -> None:
    q = spheres.quadrature()
    flat = np.bincount(q.pixel, q.weight, q.pixels)
    np.testing.assert_allclose(flat, np.pi, rtol=0.02)  # ∫ cos dω over every hemisphere
    height = np.cos(np.pi * (np.arange(spheres.ROWS) + 0.5) / spheres.ROWS)
    sky = np.maximum(height, 0).repeat(spheres.COLUMNS)  # brightest overhead
    lit = np.bincount(q.pixel, q.weight * sky[q.cell], q.pixels)
    top, bottom = lit[: q.pixels // 20].max(), lit[-q.pixels // 20 :].min()
    assert top == pytest.approx(2 * np.pi / 3, rel=0.05)  # ∫ cos² dω, facing all but up
    assert bottom < 0.01 * top
    cos_i, cos_o = cosines(*q.angles)
    assert min(cos_i.min(), cos_o.min()) > 0


def test_psnr_of_known_differences() -> None:
    truth = np.linspace(0.2, 0.8, 300, dtype=np.float32).reshape(1, 100, 3)
    assert spheres.psnr(truth, truth)[0] == pytest.approx(60.0)
    assert spheres.psnr(0 * truth, truth)[0] < 6
    near, far = (spheres.psnr(truth * f, truth)[0] for f in (0.99, 0.9))
    assert near > far + 15  # a tenth of the error is 20 dB less, but for rounding
