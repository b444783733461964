"""The BRDF basis: published reference values, physical constraints, round trips, storage."""

from __future__ import annotations

import hashlib
import io
import zipfile
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from patina.core.angles import Angles, half_difference, merl_grid
from patina.core.basis import Basis, PrincipalBRDF, default_basis, mapping, storage
from patina.core.basis.components import gram_matrix, principal_directions
from patina.core.basis.merl_folder import cached_basis, checksums
from patina.core.basis.training import DEFAULT_COUNT
from patina.core.brdf import TabulatedBRDF, merl_file, nbrdf
from patina.core.errors import InputError
from patina.core.fit import ridge

# Nielsen et al. 2015, n = 5: directions (φd, θh, θd) in degrees and the published observations
DIRECTIONS = np.radians(
    [
        [36.2, 1.4, 4.0],
        [86.5, 76.7, 13.1],
        [85.5, 7.6, 78.9],
        [144.8, 2.5, 73.8],
        [80.4, 12.9, 51.6],
    ]
)
PUBLISHED_RHO = np.array(
    [[0.09394814, 0.01236500, 0.00221087], [0.09005638, 0.00315711, 0.00270478],
     [1.38033974, 1.21132099, 1.19253075], [0.97795460, 0.85147798, 0.84648135],
     [0.10845871, 0.05911538, 0.05381590]]
)  # fmt: skip
PUBLISHED_ANGLES = Angles(DIRECTIONS[:, 1], DIRECTIONS[:, 2], DIRECTIONS[:, 0])

coefficients = st.lists(st.floats(-0.2, 0.2), min_size=15, max_size=15).map(
    lambda c: np.array(c).reshape(3, 5)
)


@pytest.fixture(scope="module")
def basis() -> Basis:
    return default_basis()


def test_default_basis_is_small_and_explains_the_variance(basis: Basis, root: Path) -> None:
    assert basis.count == 130 and basis.columns == 300
    assert (root / "assets" / "basis" / "nbrdf_basis.npz").stat().st_size < 6e6
    explained = basis.explained.cumsum()
    for k, share in ((1, 0.590), (2, 0.863), (3, 0.943), (5, 0.981), (10, 0.993), (20, 0.998)):
        assert abs(explained[k - 1] - share) < 0.003


def test_published_directions_are_well_conditioned(basis: Basis) -> None:
    assert np.linalg.cond(basis.rows(PUBLISHED_ANGLES, 5)[1]) == pytest.approx(6.0, abs=0.3)


def test_published_observations_give_a_red_glossy_material(basis: Basis) -> None:
    _, q = basis.rows(PUBLISHED_ANGLES, 5)
    brdf = PrincipalBRDF(basis, ridge.solve(q, basis.mapped(PUBLISHED_RHO, PUBLISHED_ANGLES)))
    diffuse_angles = Angles(np.radians([50.0]), np.radians([20.0]), np.radians([90.0]))
    red, green, blue = brdf.evaluate(diffuse_angles)[0]
    assert red > 3 * max(green, blue)
    grazing = Angles(np.radians([4.0]), np.radians([76.0]), np.radians([90.0]))
    grazing_rho = brdf.evaluate(grazing)[0]  # a colourless sheen, as of a dielectric
    assert grazing_rho.min() > 0.5 and grazing_rho.max() < 2.5 * grazing_rho.min()
    assert np.allclose(brdf.evaluate(PUBLISHED_ANGLES)[2], PUBLISHED_RHO[2], rtol=0.15)


def test_nearest_measured_material_is_a_red_paint(basis: Basis, shared: Path) -> None:
    _, q = basis.rows(PUBLISHED_ANGLES, 5)
    brdf = PrincipalBRDF(basis, ridge.solve(q, basis.mapped(PUBLISHED_RHO, PUBLISHED_ANGLES)))
    names, weights = nbrdf.load(shared / "data" / "brdf" / "nbrdf_merl.npz")
    nodes = basis.grid.nodes()
    rng = np.random.default_rng(0)
    visible = np.flatnonzero(merl_grid.visible(nodes).ravel())
    subset = visible[rng.permutation(len(visible))[:4000]]
    angles = Angles(*(a.ravel()[subset] for a in nodes))
    weight = mapping.cos_map(angles)
    shipped_checksums = mapping.log_weighted(brdf.evaluate(angles), weight)
    distances = [
        np.sqrt(
            np.mean(
                (mapping.log_weighted(nbrdf.evaluate(w, angles), weight) - shipped_checksums) ** 2
            )
        )
        for w in weights
    ]
    nearest = [names[i] for i in np.argsort(distances)[:3]]
    assert nearest[0] == "dark-red-paint", nearest
    # reference values computed once with η = 40
    red_coefficients = ridge.solve(q, basis.mapped(PUBLISHED_RHO, PUBLISHED_ANGLES))[0]
    assert np.allclose(red_coefficients, (-0.0566, -0.0479, -0.0033, 0.0056, -0.0225), atol=5e-4)


@settings(max_examples=25, deadline=None)
@given(c=coefficients, seed=st.integers(0, 1000))
def test_brdf_is_reciprocal_and_nonnegative(c: np.ndarray, seed: int) -> None:
    rng = np.random.default_rng(seed)
    pair = rng.normal(size=(2, 200, 3))
    pair /= np.linalg.norm(pair, axis=-1, keepdims=True)
    pair[..., 2] = np.abs(pair[..., 2])
    normal = np.broadcast_to(np.array([0.0, 0, 1]), pair[0].shape)
    brdf = PrincipalBRDF(default_basis(), c)
    forward = brdf.evaluate(half_difference(normal, pair[0], pair[1]))
    swapped = brdf.evaluate(half_difference(normal, pair[1], pair[0]))
    assert (forward >= 0).all() and np.isfinite(forward).all()
    assert np.allclose(forward, swapped, rtol=2e-3, atol=1e-6)


@settings(max_examples=20, deadline=None)
@given(c=coefficients)
def test_projection_recovers_the_coefficients(c: np.ndarray) -> None:
    basis = default_basis()
    nodes = basis.grid.nodes()
    visible = merl_grid.visible(nodes)
    angles = Angles(*(a[visible][::11] for a in nodes))
    rho = basis.evaluate(c, angles)
    # values that map below ln ε are black, and black cannot be inverted
    invertible = (rho > 1e-4).all(axis=1)
    angles = Angles(*(a[invertible] for a in angles))
    if invertible.sum() > 2000:
        assert np.allclose(basis.project(rho[invertible], angles, 5), c, atol=2e-3)


@given(rho=st.floats(0, 1e4), weight=st.floats(0.01, 1))
def test_log_mapping_round_trip(rho: float, weight: float) -> None:
    w = np.array([weight])
    restored = mapping.unlog_weighted(mapping.log_weighted(np.array([[rho]]), w), w)
    assert restored[0, 0] == pytest.approx(rho, rel=1e-9, abs=1e-9)


def test_gram_matrix_and_svd_give_equal_components() -> None:
    rng = np.random.default_rng(2)
    x = rng.normal(size=(12, 400)) * np.linspace(3, 0.1, 12)[:, None]
    w, explained = principal_directions(gram_matrix([x[:, :150], x[:, 150:]], 12), 4)
    singular = np.linalg.svd(x, compute_uv=False)
    scaled = x.T @ w
    assert np.allclose(np.linalg.norm(scaled, axis=0), singular[:4])
    assert np.allclose(explained, singular**2 / (singular**2).sum())


def test_training_coefficients_match_the_projected_materials(basis: Basis, shared: Path) -> None:
    """Row 3m + c holds channel c of material m: it equals an independent projection."""
    names, weights = nbrdf.load(shared / "data" / "brdf" / "nbrdf_merl.npz")
    assert basis.training is not None and basis.training.shape == (300, 130)
    assert np.allclose(basis.training[:, :DEFAULT_COUNT].var(axis=0), 1 / 300, rtol=0.01)
    edges = merl_grid.node_angles(0.0)
    visible = np.flatnonzero(merl_grid.visible(merl_grid.node_angles(0.5)))
    subset = np.random.default_rng(0).choice(visible, 12_000, replace=False)
    angles = Angles(*(a.ravel()[subset] for a in edges))
    for name in ("alum-bronze", "pink-felt"):
        m = names.index(name)
        found = basis.project(nbrdf.evaluate(weights[m], angles), angles, 20)
        stored = basis.training[3 * m : 3 * m + 3, :20]
        assert np.sqrt(np.mean((found - stored) ** 2)) < 0.1 * np.sqrt(np.mean(stored**2))


def test_materials_outside_of_merl_are_within_the_components(basis: Basis, shared: Path) -> None:
    """Their stored coefficients reproduce them; without the last components they are far off."""
    names, weights = nbrdf.load(shared / "data" / "brdf" / "nbrdf_validation.npz")
    assert basis.others is not None and basis.others.shape == (3 * len(names), basis.count)
    whole = np.concatenate([basis.training, basis.others])
    assert np.sqrt(np.mean(whole[:, DEFAULT_COUNT:] ** 2, axis=0)) == pytest.approx(
        300**-0.5, rel=0.01
    )
    visible = merl_grid.visible(merl_grid.node_angles(0.5))
    subset = np.random.default_rng(0).choice(np.flatnonzero(visible), 12_000, replace=False)
    angles = Angles(*(a.ravel()[subset] for a in merl_grid.node_angles(0.0)))
    for name in ("irid_flake_paint1_rgb", "paper_blue_rgb"):
        m = names.index(name)
        truth = basis.mapped(nbrdf.evaluate(weights[m], angles), angles)
        coefficients = basis.others[3 * m : 3 * m + 3]
        rows = basis.rows(angles)[1]
        off = np.std(rows @ coefficients.T - truth)
        first = slice(0, DEFAULT_COUNT)
        without = np.std(rows[:, first] @ coefficients[:, first].T - truth)
        assert off < 0.12 and off < 0.7 * without, (name, off, without)


def test_format_1_file_still_loads(basis: Basis, tmp_path: Path) -> None:
    """Format 1: int16 second differences, no training coefficients; the file is written here."""

    def encode(values: np.ndarray, step: float) -> np.ndarray:
        fixed = np.round(values / step).astype(np.int64)
        return np.diff(np.diff(fixed, axis=1, prepend=0), axis=3, prepend=0).astype(np.int16)

    path = tmp_path / "old.npz"
    np.savez(
        path,
        format=np.int32(1),
        grid=np.array([*basis.grid.shape, basis.grid.knee]),
        mean=encode(basis.mean[None], 0.0005),
        log_reference=encode(basis.log_reference[None], 0.0005),
        components=encode(basis.components[:3], 0.01),
        explained=basis.explained,
        columns=np.int32(300),
        provenance=np.array("by hand"),
    )
    old = storage.load(path)
    assert old.count == 3 and old.training is None
    assert np.allclose(old.components, basis.components[:3], atol=1e-4)
    assert np.allclose(old.mean, basis.mean, atol=1e-5)


def test_summed_table_equals_component_wise_evaluation(basis: Basis) -> None:
    """The precomputed sum over all components equals the component-wise evaluation."""
    c = np.random.default_rng(4).normal(0, 0.058, (3, 100))
    rng = np.random.default_rng(5)
    angles = Angles(*(rng.uniform(0, top, (40, 5)) for top in (1.2, 1.0, np.pi)))
    one_by_one, summed = basis.evaluate(c, angles), PrincipalBRDF(basis, c).evaluate(angles)
    assert summed.shape == (40, 5, 3)
    assert np.allclose(summed, one_by_one, rtol=1e-4, atol=1e-6)  # 1/sr; rounding of ε in float32


def test_storage_round_trip_and_truncated_file(basis: Basis, tmp_path: Path) -> None:
    path = tmp_path / "b.npz"
    storage.save(path, basis)
    loaded = storage.load(path)
    assert loaded.version == basis.version and loaded.provenance == basis.provenance
    path.write_bytes(path.read_bytes()[:5000])
    with pytest.raises(InputError, match=r"b\.npz"):
        storage.load(path)
    np.savez_compressed(path, format=np.int32(2), components=np.zeros(1 << 27, np.int32))
    assert path.stat().st_size < 1 << 20
    with pytest.raises(InputError, match="unpacks to 537 MB; expected at most 268 MB"):
        storage.load(path)


def test_damaged_archives_are_one_sentence(tmp_path: Path) -> None:
    path, array, archive = tmp_path / "b.npz", io.BytesIO(), io.BytesIO()
    np.save(array, np.zeros(3))
    np.savez(archive, format=np.int32(2))
    path.write_bytes(array.getvalue() + archive.getvalue())
    with pytest.raises(InputError, match="not an archive of arrays"):
        storage.load(path)
    huge = io.BytesIO()
    np.lib.format.write_array_header_1_0(
        huge, {"descr": "<f8", "fortran_order": False, "shape": (10**13,)}
    )
    with zipfile.ZipFile(path, "w") as made:
        made.writestr("format.npy", huge.getvalue())
    with pytest.raises(InputError, match="an array is too large"):
        storage.load(path)


def test_interpolation_is_exact_at_nodes_and_periodic(basis: Basis) -> None:
    nodes = basis.grid.nodes()
    centre, rows = basis.rows(Angles(*(a.ravel()[::97] for a in nodes)), 3)
    assert np.allclose(centre, (basis.mean + basis.log_reference).ravel()[::97], atol=1e-4)
    assert np.allclose(rows.T, basis.components[:3].reshape(3, -1)[:, ::97], atol=1e-3)
    at = [np.array([0.4]), np.array([0.7])]
    start, end = (basis.rows(Angles(*at, np.array([p])), 3)[1] for p in (1e-7, np.pi - 1e-7))
    assert np.allclose(start, end, atol=1e-3)


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("merl")
    rng = np.random.default_rng(5)
    for name in "abc":
        brdf = PrincipalBRDF(default_basis(), rng.normal(0, 0.05, (3, 6)))
        merl_file.write(folder / f"{name}.binary", TabulatedBRDF.from_function(brdf.evaluate))
    return folder


class TestMerlFolder:
    """Three synthetic files with known checksums stand in for the 100 MERL files."""

    @staticmethod
    def file_checksums(folder: Path) -> dict[str, str]:
        return {
            p.name: hashlib.sha256(p.read_bytes()).hexdigest()
            for p in sorted(folder.glob("*.binary"))
        }

    def test_basis_represents_its_training_materials_and_is_cached(
        self, folder: Path, tmp_path: Path
    ) -> None:
        stages: list[str] = []
        trained = cached_basis(
            folder, lambda stage, _: stages.append(stage), self.file_checksums(folder), tmp_path
        )
        assert trained.columns == 9 and "principal components" in stages
        table = merl_file.read(folder / "a.binary")
        centres = merl_grid.node_angles(0.5)
        angles = Angles(*(a[table.valid][::37] for a in centres))
        rho = np.moveaxis(table.values, 0, -1)[table.valid][::37]
        fit = trained.evaluate(trained.project(rho, angles, trained.count, eta=1e-6), angles)
        weight = mapping.cos_map(angles)
        error = mapping.log_weighted(fit, weight) - mapping.log_weighted(rho, weight)
        assert np.sqrt(np.mean(error**2)) < 0.03
        stages.clear()
        reloaded = cached_basis(
            folder, lambda stage, _: stages.append(stage), self.file_checksums(folder), tmp_path
        )
        assert reloaded.version == storage.load(next(tmp_path.glob("*.npz"))).version
        assert reloaded.version == trained.version, (
            "a result of the first run must find its basis again"
        )
        assert "principal components" not in stages

    def test_error_names_missing_truncated_or_altered_files(
        self, folder: Path, tmp_path: Path
    ) -> None:
        checksums_of_files = self.file_checksums(folder)
        with pytest.raises(InputError, match=r"missing.*zzz\.binary"):
            cached_basis(folder, expected={**checksums_of_files, "zzz.binary": "0"}, cache=tmp_path)
        with pytest.raises(InputError, match=r"b\.binary.*genuine"):
            cached_basis(folder, expected={**checksums_of_files, "b.binary": "0"}, cache=tmp_path)
        truncated = tmp_path / "c.binary"
        truncated.write_bytes((folder / "c.binary").read_bytes()[:-8])
        with pytest.raises(InputError, match=r"c\.binary.*incomplete"):
            cached_basis(
                tmp_path, expected={"c.binary": checksums_of_files["c.binary"]}, cache=tmp_path
            )

    def test_checksums_of_all_100_files_are_shipped(self, shared: Path) -> None:
        published_checksums = (shared / "data" / "brdf" / "merl_sha256.csv").read_text().split()
        shipped_checksums = checksums()
        assert len(shipped_checksums) == 100 and all(
            digest in " ".join(published_checksums) for digest in shipped_checksums.values()
        )
