"""Textures that the OSL shader reads: they hold the BRDF with the interpolation of the basis."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from patina.core.angles import Angles, cosines
from patina.core.appearance import osl_atlas, osl_source
from patina.core.basis import PrincipalBRDF, default_basis, mapping

COUNT = 8


@pytest.fixture(scope="module")
def angles() -> Angles:
    rng = np.random.default_rng(1)
    n = 20000
    drawn = Angles(
        rng.uniform(0, 1, n) ** 2 * np.pi / 2,
        rng.uniform(0, np.pi / 2, n),
        rng.uniform(0, np.pi, n),
    )
    kept = np.minimum(*cosines(*drawn)) > 0.05
    edges = Angles(*(np.array(x) for x in ([0.0, 0.3], [0.0, 0.2], [0.0, np.pi - 1e-9])))
    return Angles(*(np.concatenate([a[kept], e]) for a, e in zip(drawn, edges, strict=True)))


def _through_textures(brdf: PrincipalBRDF, angles: Angles, coefficients) -> np.ndarray:
    """ρ as the shader computes it from the textures of ``brdf`` with these values as its inputs."""
    grid = brdf.basis.grid
    half_pi = np.pi / 2
    u = np.stack(
        [
            np.log1p(angles.theta_h / grid.knee) / np.log1p(half_pi / grid.knee) * (grid.n_h - 1),
            angles.theta_d / half_pi * (grid.n_d - 1),
            angles.phi_d / np.pi * grid.n_p,
        ],
        axis=-1,
    )
    atlas, remainder = osl_atlas.component_texels(brdf.basis), osl_atlas.remainder_texels(brdf)
    k = osl_atlas.traits(coefficients.shape[1])
    rows = range(osl_atlas.groups(k))
    slots = np.concatenate([osl_atlas.lookup(atlas, grid, u, g) for g in rows], axis=1)
    logarithm = osl_atlas.lookup(remainder, grid, u, 0) + slots[:, :k] @ coefficients[:, :k].T
    return mapping.unlog_weighted(logarithm, mapping.cos_map(angles))


def _relative_error(read: np.ndarray, exact: np.ndarray, angles: Angles) -> np.ndarray:
    weight = mapping.cos_map(angles)[:, None]
    return np.abs(read - exact) * weight / (exact * weight + mapping.EPSILON)


@pytest.mark.parametrize("count", [5, 6, 20, 100])
def test_shader_textures_reproduce_brdf(angles: Angles, count: int) -> None:
    basis = default_basis()
    c = np.random.default_rng(2).normal(0, np.sqrt(basis.coefficient_variance), (3, count))
    # component by component, at every direction: no table of partial sums in between
    exact = basis.evaluate(c, angles).astype(float)
    error = _relative_error(_through_textures(PrincipalBRDF(basis, c), angles, c), exact, angles)
    assert error.max() < 1e-4


def test_changed_coefficient_gives_another_brdf_of_basis(angles: Angles) -> None:
    """A change by the user goes through half floats: an error of a thousandth, not more."""
    basis = default_basis()
    c = np.random.default_rng(3).normal(0, np.sqrt(basis.coefficient_variance), (3, 60))
    moved = c.copy()
    moved[:, :8] += np.random.default_rng(4).normal(0, 0.06, (3, 8))
    exact = basis.evaluate(moved, angles).astype(float)
    error = _relative_error(
        _through_textures(PrincipalBRDF(basis, c), angles, moved), exact, angles
    )
    assert np.sqrt(np.mean(error**2)) < 5e-4 and error.max() < 5e-3


def test_texture_files_are_small_and_keep_values(tmp_path: Path) -> None:
    import OpenImageIO as oiio

    basis = default_basis()
    brdf = PrincipalBRDF(basis, np.random.default_rng(5).normal(0, 0.06, (3, 100)))
    path = osl_atlas.write_components(tmp_path / osl_atlas.components_name(basis), basis)
    assert path.stat().st_size < 2e6
    pixels = oiio.ImageBuf(str(path)).get_pixels(oiio.HALF)
    np.testing.assert_array_equal(pixels, osl_atlas.component_texels(basis))
    path = osl_atlas.write_remainder(tmp_path / osl_atlas.remainder_name(brdf), brdf)
    assert path.stat().st_size < 2e6
    pixels = oiio.ImageBuf(str(path)).get_pixels(oiio.FLOAT)
    np.testing.assert_array_equal(pixels, osl_atlas.remainder_texels(brdf))
    assert not list(tmp_path.glob("*.part*"))


def test_each_brdf_has_its_own_file() -> None:
    basis = default_basis()
    c = np.random.default_rng(6).normal(0, 0.06, (3, 10))
    name = osl_atlas.remainder_name(PrincipalBRDF(basis, c))
    assert name == osl_atlas.remainder_name(PrincipalBRDF(basis, c.copy()))
    assert name != osl_atlas.remainder_name(PrincipalBRDF(basis, c + 1e-9))


def test_shader_source_has_all_inputs_and_no_placeholder():
    text = osl_source.source(default_basis(), COUNT)
    assert "@" not in text
    for item in osl_source.inputs(COUNT):
        assert f" {item.name} " in text
    assert osl_source.coefficient_inputs(COUNT)[0].label == "Coefficient 1"
