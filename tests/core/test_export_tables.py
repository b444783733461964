"""The table formats, read by independent code, and their stated losses."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np
import OpenImageIO as oiio
import pytest

from patina.core.angles import Angles
from patina.core.errors import InputError
from patina.core.export import losses, table_formats
from patina.core.export.file_names import check_distinct, identifier
from patina.core.export.subject import Subject
from patina.core.result import read_result
from tests import make_result as made

CELLS = [(0, 0, 0), (7, 40, 20), (30, 33, 120), (60, 5, 179)]


@pytest.fixture(scope="module")
def subjects(tmp_path_factory: pytest.TempPathFactory) -> list[Subject]:
    folder = made.two_materials(tmp_path_factory.mktemp("result"))
    return [Subject(m) for m in read_result(folder).materials]


@pytest.fixture(scope="module")
def written_files(subjects, tmp_path_factory: pytest.TempPathFactory):
    folder = tmp_path_factory.mktemp("files")
    found = {
        name: getattr(table_formats, f"write_{name}")(folder, subjects)
        for name in ("binary", "exr", "npz")
    }
    return folder, found


def truth(subject: Subject, cells: list[tuple[int, int, int]]) -> np.ndarray:
    """(n, 3) BRDF values at the cell centres defined in the documentation."""
    ih, idx, ip = np.array(cells).T
    return subject.material.brdf.evaluate(
        Angles(np.radians(90 * ((ih + 0.5) / 90) ** 2), np.radians(idx + 0.5), np.radians(ip + 0.5))
    )


def test_merl_binary_read_independently(written_files, subjects) -> None:
    """The MERL binary file is read here as in the database's sample code."""
    folder, _ = written_files
    for subject in subjects:
        raw = (folder / f"{subject.name}.binary").read_bytes()
        assert np.frombuffer(raw, "<i4", 3).tolist() == [90, 90, 180]
        values = np.frombuffer(raw, "<f8", offset=12)
        assert values.size == 3 * 90 * 90 * 180
        for cell, expected in zip(CELLS, truth(subject, CELLS), strict=True):
            ih, idx, ip = cell
            indices = ip + 180 * idx + 180 * 90 * ih + np.arange(3) * 90 * 90 * 180
            found = values[indices] * np.array([1.0, 1.15, 1.66]) / 1500
            assert np.allclose(found, expected, rtol=1e-5)
        # light from below the horizon: thetaH and thetaD both near 90 degrees, phiD near 0
        assert values[0 + 180 * 89 + 180 * 90 * 89] == -1


def test_exr_read_as_its_readme_describes(written_files, subjects) -> None:
    folder, found = written_files
    readme = (folder / "README_exr.txt").read_text("utf-8")
    assert "reshape(90, 90, 180, 3)" in readme and subjects[0].material.brdf.basis.version in readme
    for subject in subjects:
        table = oiio.ImageBuf(str(folder / f"{subject.id}_table.exr")).get_pixels(oiio.FLOAT)
        table = table.reshape(90, 90, 180, 3)
        assert np.allclose([table[cell] for cell in CELLS], truth(subject, CELLS), rtol=1e-5)
        assert (table[89, 89, 0] == -1).all()
    # mean, reference and components by slabs, coefficients by column: the BRDF at one node
    basis = subjects[0].material.brdf.basis
    n_h, n_d, n_p = 84, 46, 30
    pixels = oiio.ImageBuf(str(folder / f"basis_{basis.version}.exr")).get_pixels(oiio.FLOAT)
    slabs = pixels.reshape(-1, n_h, n_d, n_p)
    c = oiio.ImageBuf(str(folder / f"{subjects[0].id}_coefficients.exr")).get_pixels(oiio.FLOAT)[0]
    ih, idx, ip = 20, 12, 7
    knee = np.radians(0.7)
    theta_h = knee * np.expm1(ih / (n_h - 1) * np.log1p(np.pi / 2 / knee))
    theta_d, phi_d = np.radians(90 * idx / (n_d - 1)), np.radians(180 * ip / n_p)
    log = slabs[0, ih, idx, ip] + slabs[1, ih, idx, ip] + slabs[2:, ih, idx, ip] @ c
    cos_i = np.cos(theta_h) * np.cos(theta_d) - np.sin(theta_h) * np.sin(theta_d) * np.cos(phi_d)
    cos_o = np.cos(theta_h) * np.cos(theta_d) + np.sin(theta_h) * np.sin(theta_d) * np.cos(phi_d)
    rho = (np.exp(log) - 0.001) / np.clip(cos_i * cos_o, 0.01, 1)
    node_angles = Angles(*(np.array([a]) for a in (theta_h, theta_d, phi_d)))
    assert np.allclose(rho, subjects[0].material.brdf.evaluate(node_angles)[0], rtol=2e-4)
    assert f"basis_{basis.version}.exr" in found["exr"][0].files


def test_npz_read_with_numpy(written_files, subjects) -> None:
    folder, _ = written_files
    subject = subjects[1]
    with np.load(folder / f"{subject.id}.npz", allow_pickle=False) as data:
        table, log_table = data["table"], data["log_table"]
        theta_h, theta_d, phi_d = data["theta_h"], data["theta_d"], data["phi_d"]
        coefficients, version = data["coefficients"], str(data["basis_version"])
    assert np.allclose([table[:, a, b, c] for a, b, c in CELLS], truth(subject, CELLS), rtol=1e-5)
    with np.load(folder / f"basis_{version}.npz", allow_pickle=False) as basis:
        ih, idx, ip = 33, 20, 11
        summed = basis["mean"][ih, idx, ip] + basis["log_reference"][ih, idx, ip]
        summed = summed + coefficients @ basis["components"][:, ih, idx, ip]
    assert np.allclose(log_table[ih, idx, ip], summed, atol=2e-4)
    node_angles = Angles(*(np.array([a]) for a in (theta_h[ih], theta_d[idx], phi_d[ip])))
    cosine_difference = np.sin(theta_h[ih]) * np.sin(theta_d[idx]) * np.cos(phi_d[ip])
    cosine_sum = np.cos(theta_h[ih]) * np.cos(theta_d[idx])
    weight = np.clip((cosine_sum - cosine_difference) * (cosine_sum + cosine_difference), 0.01, 1)
    expected = subject.material.brdf.evaluate(node_angles)[0]
    assert np.allclose((np.exp(log_table[ih, idx, ip]) - 0.001) / weight, expected, rtol=2e-4)


def test_losses_are_written_and_plausible(written_files, tmp_path: Path) -> None:
    _, found = written_files
    all_losses = [loss for file_losses in found.values() for loss in file_losses]
    lines = losses.write_losses(tmp_path, all_losses, "a test")
    stored = json.loads((tmp_path / "losses.json").read_text("utf-8"))
    assert len(stored["losses"]) == len(all_losses) == 6
    assert (tmp_path / "losses.txt").read_text("utf-8") == "\n".join(lines)
    for loss in found["binary"]:
        interpolated, nearest = loss.errors.values()
        # the table's cells are finer than the basis' nodes: interpolation loses little, the
        # nearest cell more
        assert 0 < interpolated < 0.02 and interpolated < nearest < 0.1


@pytest.mark.parametrize("factor", [0.5, 0.9, 1.0, 8.0])
def test_cube_root_error_of_a_constant_factor(factor: float) -> None:
    def lambertian(angles: Angles) -> np.ndarray:
        return np.full((len(angles.theta_h), 3), 0.2)

    found = losses.cube_root_error(lambda angles: factor * lambertian(angles), lambertian)
    assert found == pytest.approx(abs(np.cbrt(factor) - 1), abs=1e-12)


def test_names_become_distinct_identifiers() -> None:
    assert identifier("old rug") == "old_rug" and identifier("Émail №3") == "Email_No3"
    assert identifier("3 tins") == "m_3_tins" and identifier("漆") == "material"
    assert identifier("con") == "m_con"
    with pytest.raises(InputError, match="both"):
        check_distinct(["old rug", "old-rug"])
