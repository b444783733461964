"""A basis without some of its materials, against components computed from scratch."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path

import numpy as np
import pytest

from patina.core.angles import Angles, cosines, merl_grid
from patina.core.basis import AngleGrid
from patina.core.basis.training import train
from patina.core.basis.training_set import TrainedBasis, TrainingSet
from patina.core.errors import InputError, PatinaError

NAMES = ("chalk", "slate", "satin", "gloss", "velvet")
GRID = AngleGrid(12, 7, 6, float(np.radians(2.0)))


class Lobes:
    """Analytic columns: a diffuse part and a lobe in θh, another for every channel."""

    def __init__(self, which: list[int]) -> None:
        self.which = which
        pick = np.random.default_rng(0).choice(90 * 90 * 180, 4000, replace=False)
        centres = [a.ravel()[pick] for a in merl_grid.node_angles(0.5)]
        seen = merl_grid.visible(Angles(*centres))
        self.cells = Angles(*(a[seen] for a in centres))

    @property
    def columns(self) -> int:
        return 3 * len(self.which)

    def at(self, angles: Angles) -> np.ndarray:
        out = []
        for m in self.which:
            for c in range(3):
                width = 0.05 + 0.12 * m + 0.02 * c
                lobe = np.exp(-((angles.theta_h / width) ** 2)) * (1 + np.cos(angles.theta_d) ** m)
                out.append(0.02 + 0.05 * c * (m % 2) + lobe + 0.1 * np.sin(angles.phi_d) ** 2)
        return np.array(out, np.float32)

    def cell_blocks(self) -> Iterator[tuple[Angles, np.ndarray, float]]:
        for part in (slice(0, 1500), slice(1500, None)):
            angles = Angles(*(a[part] for a in self.cells))
            yield angles, self.at(angles), 0.0


@pytest.fixture(scope="module")
def whole() -> TrainingSet:
    return TrainingSet.compute(Lobes([0, 1, 2, 3, 4]), NAMES, "analytic lobes", GRID)


@pytest.mark.parametrize("without", [(), ("satin",), ("chalk", "velvet")])
def test_agrees_with_training_on_the_rest(whole: TrainingSet, without: tuple[str, ...]) -> None:
    kept = [i for i, name in enumerate(NAMES) if name not in without]
    expected = train(Lobes(kept), "analytic lobes", 4, GRID)
    found = whole.basis(without, 4)
    assert found.columns == 3 * len(kept)
    assert found.materials == tuple(NAMES[i] for i in kept)
    np.testing.assert_allclose(found.mean, expected.mean, atol=2e-5)
    np.testing.assert_allclose(found.log_reference, expected.log_reference, atol=2e-5)
    np.testing.assert_allclose(found.explained, expected.explained, atol=1e-6)
    scale = np.abs(expected.components).max()
    np.testing.assert_allclose(found.components, expected.components, atol=2e-3 * scale)


def test_training_coefficients_give_the_columns_back(whole: TrainingSet) -> None:
    """With every component kept, row i of ``training`` must reproduce column i itself."""
    lobes = Lobes([0, 1, 3, 4])
    basis = whole.basis(("satin",), 11)
    assert isinstance(basis, TrainedBasis) and basis.training is not None
    nodes = Angles(*(a.ravel() for a in GRID.nodes()))
    cos_i, cos_o = cosines(*nodes)
    expected = np.log(lobes.at(nodes) * np.clip(cos_i * cos_o, 0.01, 1) + 1e-3)
    centre, rows = basis.rows(nodes)
    found = centre[:, None] + rows @ basis.training.T
    np.testing.assert_allclose(found, expected.T, atol=2e-3)
    np.testing.assert_allclose(basis.training.T @ basis.training, np.eye(11), atol=1e-9)


def test_what_is_left_out_leaves_no_trace(whole: TrainingSet) -> None:
    """Two sets that differ only in one material give the same basis without it."""

    class Other(Lobes):
        def at(self, angles: Angles) -> np.ndarray:
            out = super().at(angles)
            out[6:9] = 7.0 + angles.theta_h
            return out

    other = TrainingSet.compute(Other([0, 1, 2, 3, 4]), NAMES, "other", GRID)
    a, b = whole.basis(("satin",), 4), other.basis(("satin",), 4)
    np.testing.assert_allclose(a.components, b.components, atol=2e-3 * np.abs(a.components).max())
    assert not np.allclose(whole.basis((), 4).mean, other.basis((), 4).mean, atol=0.01)


def test_kept_on_disk(whole: TrainingSet, tmp_path: Path) -> None:
    file = tmp_path / "set.npz"
    whole.save(file)
    again = TrainingSet.load(file)
    assert again.materials == NAMES and again.grid == GRID
    np.testing.assert_array_equal(again.logs, whole.logs)
    np.testing.assert_array_equal(again.products, whole.products)
    file.write_bytes(file.read_bytes()[:1000])
    with pytest.raises(InputError, match=r"set\.npz"):
        TrainingSet.load(file)


def test_refuses_what_it_does_not_have(whole: TrainingSet) -> None:
    with pytest.raises(PatinaError, match="marble"):
        whole.basis(("marble",), 4)
    with pytest.raises(PatinaError, match="12 training columns"):
        whole.basis(("satin",), 12)
