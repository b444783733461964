"""The atlas that OSL reads: same interpolation as the basis, and what half floats cost."""

from __future__ import annotations

import numpy as np
import pytest

from patina.core.angles import Angles, cosines
from patina.core.appearance import osl_atlas, osl_source
from patina.core.basis import Basis, mapping

COUNT = 20


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


def _through_atlas(atlas, basis: Basis, angles: Angles, coefficients) -> np.ndarray:
    """ρ as the shader computes it, from the texels."""
    grid = basis.grid
    half_pi = np.pi / 2
    u = np.stack(
        [
            np.log1p(angles.theta_h / grid.knee) / np.log1p(half_pi / grid.knee) * (grid.n_h - 1),
            angles.theta_d / half_pi * (grid.n_d - 1),
            angles.phi_d / np.pi * grid.n_p,
        ],
        axis=-1,
    )
    rows = osl_atlas.groups(coefficients.shape[1])
    slots = np.concatenate([osl_atlas.lookup(atlas, grid, u, g) for g in range(rows)], axis=1)
    k = coefficients.shape[1]
    logarithm = slots[:, :2].sum(axis=1)[:, None] + slots[:, 2 : 2 + k] @ coefficients.T
    return mapping.unlog_weighted(logarithm, mapping.cos_map(angles))


def test_half_floats_cost_less_than_a_thousandth(angles):
    basis = Basis.default()
    rng = np.random.default_rng(2)
    atlas = osl_atlas.texels(basis)
    assert atlas.shape == (*osl_atlas.size(basis.grid, basis.count)[::-1], 4)
    assert np.isfinite(atlas).all()
    for count in (5, COUNT):
        c = rng.normal(0, np.sqrt(basis.coefficient_variance), (3, count))
        exact = basis.evaluate(c, angles).astype(float)
        read = _through_atlas(atlas, basis, angles, c)
        error = np.abs(read - exact) * mapping.cos_map(angles)[:, None]
        scale = exact * mapping.cos_map(angles)[:, None] + mapping.EPSILON
        relative = error / scale
        assert np.sqrt(np.mean(relative**2)) < 3e-4
        assert relative.max() < 3e-3


def test_the_file_is_small_and_holds_what_was_written(tmp_path):
    import OpenImageIO as oiio

    basis = Basis.default()
    path = osl_atlas.write(tmp_path / osl_atlas.file_name(basis), basis)
    assert path.stat().st_size < 8e6
    pixels = oiio.ImageBuf(str(path)).get_pixels(oiio.HALF)
    np.testing.assert_array_equal(pixels, osl_atlas.texels(basis))
    assert not list(tmp_path.glob("*.part*"))


def test_source_has_every_input_and_no_word_left():
    text = osl_source.source(Basis.default(), COUNT)
    assert "@" not in text
    for item in osl_source.inputs(COUNT):
        assert f" {item.name} " in text
    assert osl_source.coefficient_inputs(COUNT)[0].label == "Coefficient 1"
