"""A basis without some training materials, compared with one trained from scratch."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path

import numpy as np
import pytest

from patina.core.angles import Angles, cosines, merl_grid
from patina.core.basis import AngleGrid, residual_components
from patina.core.basis.training import train
from patina.core.basis.training_set import TrainedBasis, TrainingSet
from patina.core.errors import InputError, PatinaError

NAMES = ("chalk", "slate", "satin", "gloss", "velvet")
GRID = AngleGrid(12, 7, 6, float(np.radians(2.0)))


class AnalyticLobes:
    """Analytic training columns: a diffuse part and a lobe in θh that differs per channel."""

    def __init__(self, which: list[int]) -> None:
        self.which = which
        chosen_cells = np.random.default_rng(0).choice(90 * 90 * 180, 4000, replace=False)
        centres = [a.ravel()[chosen_cells] for a in merl_grid.node_angles(0.5)]
        visible = merl_grid.visible(Angles(*centres))
        self.cells = Angles(*(a[visible] for a in centres))

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
def full_set() -> TrainingSet:
    return TrainingSet.compute(AnalyticLobes([0, 1, 2, 3, 4]), NAMES, "analytic lobes", GRID)


@pytest.mark.parametrize("without", [(), ("satin",), ("chalk", "velvet")])
def test_basis_equals_one_trained_without_the_materials(
    full_set: TrainingSet, without: tuple[str, ...]
) -> None:
    remaining = [i for i, name in enumerate(NAMES) if name not in without]
    expected = train(AnalyticLobes(remaining), "analytic lobes", 4, GRID)
    found = full_set.basis(without, 4)
    assert found.columns == 3 * len(remaining)
    assert found.materials == tuple(NAMES[i] for i in remaining)
    np.testing.assert_allclose(found.mean, expected.mean, atol=2e-5)
    np.testing.assert_allclose(found.log_reference, expected.log_reference, atol=2e-5)
    np.testing.assert_allclose(found.explained, expected.explained, atol=1e-6)
    scale = np.abs(expected.components).max()
    np.testing.assert_allclose(found.components, expected.components, atol=2e-3 * scale)


def test_other_materials_change_only_the_last_components(
    full_set: TrainingSet, monkeypatch: pytest.MonkeyPatch
) -> None:
    """With two materials outside the database, mean and first components are those of the database
    alone, and all components together reproduce every material. Training in one go gives the same
    basis."""
    monkeypatch.setattr(residual_components, "OTHERS_COUNT", 5)
    others = ("satin", "chalk")
    inside = [i for i, name in enumerate(NAMES) if name not in others]
    outside = [NAMES.index(name) for name in others]
    alone, found = full_set.basis(others, 3), full_set.basis((), 3, others)
    assert found.columns == alone.columns and found.materials == alone.materials
    np.testing.assert_allclose(found.mean, alone.mean, atol=1e-6)
    np.testing.assert_allclose(found.components[:3], alone.components, atol=1e-5)
    at_once = train(AnalyticLobes(inside), "analytic lobes", 3, GRID, others=AnalyticLobes(outside))
    nodes = Angles(*(a.ravel() for a in GRID.nodes()))
    cos_i, cos_o = cosines(*nodes)
    rho = AnalyticLobes([*inside, *outside]).at(nodes)
    truth = np.log(rho * np.clip(cos_i * cos_o, 0.01, 1) + 1e-3).T
    for basis in (found, at_once):
        assert basis.training is not None and basis.others is not None
        known = np.concatenate([basis.training, basis.others])
        assert basis.others.shape == (6, 8)
        assert np.sqrt(np.mean(known[:, 3:] ** 2, axis=0)) == pytest.approx(basis.columns**-0.5)
        centre, rows = basis.rows(nodes)
        spread = np.std(truth)
        assert np.std(centre[:, None] + rows @ known.T - truth) < 0.02 * spread
        first = rows[:, :3] @ known[:, :3].T
        assert np.std(centre[:, None] + first - truth) > 0.05 * spread, "they are outside"
    scale = np.abs(at_once.components).max()
    np.testing.assert_allclose(found.components, at_once.components, atol=5e-3 * scale)


def test_training_coefficients_reproduce_the_columns(full_set: TrainingSet) -> None:
    """With all components, row i of ``training`` reproduces training column i."""
    lobes = AnalyticLobes([0, 1, 3, 4])
    basis = full_set.basis(("satin",), 11)
    assert isinstance(basis, TrainedBasis) and basis.training is not None
    nodes = Angles(*(a.ravel() for a in GRID.nodes()))
    cos_i, cos_o = cosines(*nodes)
    expected = np.log(lobes.at(nodes) * np.clip(cos_i * cos_o, 0.01, 1) + 1e-3)
    centre, rows = basis.rows(nodes)
    found = centre[:, None] + rows @ basis.training.T
    np.testing.assert_allclose(found, expected.T, atol=2e-3)
    np.testing.assert_allclose(basis.training.T @ basis.training, np.eye(11), atol=1e-9)


def test_excluded_material_does_not_affect_the_basis(full_set: TrainingSet) -> None:
    """Two training sets that differ in one material give the same basis without that material."""

    class OtherSatin(AnalyticLobes):
        def at(self, angles: Angles) -> np.ndarray:
            out = super().at(angles)
            out[6:9] = 7.0 + angles.theta_h
            return out

    other = TrainingSet.compute(OtherSatin([0, 1, 2, 3, 4]), NAMES, "other", GRID)
    a, b = full_set.basis(("satin",), 4), other.basis(("satin",), 4)
    np.testing.assert_allclose(a.components, b.components, atol=2e-3 * np.abs(a.components).max())
    assert not np.allclose(full_set.basis((), 4).mean, other.basis((), 4).mean, atol=0.01)


def test_training_set_file_round_trip(full_set: TrainingSet, tmp_path: Path) -> None:
    file = tmp_path / "set.npz"
    full_set.save(file)
    loaded = TrainingSet.load(file)
    assert loaded.materials == NAMES and loaded.grid == GRID
    np.testing.assert_array_equal(loaded.logs, full_set.logs)
    np.testing.assert_array_equal(loaded.products, full_set.products)
    file.write_bytes(file.read_bytes()[:1000])
    with pytest.raises(InputError, match=r"set\.npz"):
        TrainingSet.load(file)


def test_unknown_materials_and_too_many_components_are_rejected(full_set: TrainingSet) -> None:
    with pytest.raises(PatinaError, match="marble"):
        full_set.basis(("marble",), 4)
    with pytest.raises(PatinaError, match="12 training columns"):
        full_set.basis(("satin",), 12)
