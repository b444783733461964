"""Half/difference angles: round trips, reciprocity, poles, the MERL grid."""

from __future__ import annotations

import numpy as np
from hypothesis import given
from hypothesis import strategies as st

from patina.core.angles import Angles, cosines, fold_phi_d, half_difference, light_view, merl_grid

NORMAL = np.array([0.0, 0.0, 1.0])
unit = st.floats(-1, 1, allow_nan=False)


def random_directions(seed: int, n: int = 500) -> tuple[np.ndarray, np.ndarray]:
    rng = np.random.default_rng(seed)
    pair = rng.normal(size=(2, n, 3))
    pair /= np.linalg.norm(pair, axis=-1, keepdims=True)
    pair[..., 2] = np.abs(pair[..., 2])
    return pair[0], pair[1]


@given(
    theta_h=st.floats(1e-6, np.pi / 2),
    theta_d=st.floats(1e-6, np.pi / 2 - 1e-6),
    phi_d=st.floats(0, np.pi - 1e-6),
)
def test_angles_to_directions_round_trip(theta_h: float, theta_d: float, phi_d: float) -> None:
    angles = Angles(*(np.array([x]) for x in (theta_h, theta_d, phi_d)))
    light, view = light_view(*angles)
    assert np.allclose(np.linalg.norm(light, axis=-1), 1) and np.allclose(
        np.linalg.norm(view, axis=-1), 1
    )
    back = half_difference(np.broadcast_to(NORMAL, light.shape), light, view)
    assert np.allclose(back.theta_h, theta_h, atol=1e-9)
    assert np.allclose(back.theta_d, theta_d, atol=1e-9)
    # φd = 0 and φd = π are the same direction; the error of φd grows as θh or θd approaches 0
    phi_d_error = np.abs((back.phi_d - phi_d + np.pi / 2) % np.pi - np.pi / 2)
    assert phi_d_error < 1e-9 / (np.sin(theta_h) * np.sin(theta_d)) + 1e-9


@given(seed=st.integers(0, 10_000))
def test_angles_are_reciprocal(seed: int) -> None:
    light, view = random_directions(seed, 50)
    normal = np.broadcast_to(NORMAL, light.shape)
    a, b = half_difference(normal, light, view), half_difference(normal, view, light)
    assert np.allclose(a.theta_h, b.theta_h) and np.allclose(a.theta_d, b.theta_d)
    assert np.allclose(np.sin(a.phi_d - b.phi_d), 0, atol=1e-6)


@given(seed=st.integers(0, 10_000))
def test_angles_are_invariant_under_common_rotation(seed: int) -> None:
    light, view = random_directions(seed, 50)
    normal = np.broadcast_to(NORMAL, light.shape)
    q, _ = np.linalg.qr(np.random.default_rng(seed).normal(size=(3, 3)))
    q *= np.sign(np.linalg.det(q))
    a = half_difference(normal, light, view)
    b = half_difference(normal @ q.T, light @ q.T, view @ q.T)
    for x, y in zip(a[:2], b[:2], strict=True):
        assert np.allclose(x, y, atol=1e-7)
    assert np.allclose(np.sin(a.phi_d - b.phi_d), 0, atol=1e-5)


@given(seed=st.integers(0, 10_000))
def test_cosines_match_the_directions(seed: int) -> None:
    light, view = random_directions(seed)
    angles = half_difference(np.broadcast_to(NORMAL, light.shape), light, view)
    cos_i, cos_o = cosines(*angles)
    # folding φd may have swapped light and view
    assert np.allclose(np.sort([cos_i, cos_o], axis=0), np.sort([light[:, 2], view[:, 2]], axis=0))


def test_angles_are_exact_at_the_poles() -> None:
    up = NORMAL[None]
    straight = half_difference(up, up, up)
    assert straight.theta_h[0] == 0 and straight.theta_d[0] == 0
    tilt = np.radians(40)
    light = np.array([[np.sin(tilt), 0, np.cos(tilt)]])
    mirror = half_difference(up, light, light * [-1, 1, 1])
    assert mirror.theta_h[0] == 0 and np.isclose(mirror.theta_d[0], tilt)
    retro = half_difference(up, light, light)
    assert np.isclose(retro.theta_h[0], tilt) and retro.theta_d[0] < 1e-12
    tiny = np.radians(1e-5)  # acos would return 0 here
    light = np.array([[np.sin(tiny), 0, np.cos(tiny)]])
    assert np.isclose(half_difference(up, light, light).theta_h[0], tiny, rtol=1e-9)


def test_opposite_directions_give_finite_angles() -> None:
    angles = half_difference(NORMAL[None], np.array([[1.0, 0, 0]]), np.array([[-1.0, 0, 0]]))
    assert all(np.isfinite(a).all() for a in angles)


@given(phi=st.floats(-50, 50))
def test_folded_phi_d_is_in_range(phi: float) -> None:
    folded = fold_phi_d(np.array([phi]))
    assert 0 <= folded[0] < np.pi
    assert np.isclose(np.sin(folded[0] - phi), 0, atol=1e-9)


def test_cell_centres_and_edges_map_to_their_own_cell() -> None:
    for offset in (0.5, 1e-9):
        ih, idx, ip = merl_grid.index(merl_grid.node_angles(offset))
        expected = np.indices(merl_grid.SHAPE)
        assert (ih == expected[0]).mean() > 0.999  # the square root may round across a cell edge
        assert (idx == expected[1]).mean() > 0.98
        assert (ip == expected[2]).mean() > 0.98
    assert int(merl_grid.visible(merl_grid.node_angles(0.5)).sum()) == 1_096_216
