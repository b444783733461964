"""The MERL file format: round trip, comparison with an independent reader, and invalid files."""

from __future__ import annotations

import struct
from pathlib import Path

import numpy as np
import pytest

from patina.core.angles import merl_grid
from patina.core.brdf import TabulatedBRDF, merl_file
from patina.core.errors import InputError


@pytest.fixture(scope="module")
def table() -> TabulatedBRDF:
    rng = np.random.default_rng(3)
    values = rng.gamma(0.5, 1.0, (3, *merl_grid.SHAPE)).astype(np.float32)
    values[:, ~merl_grid.visible(merl_grid.node_angles(0.5))] = -1.0
    return TabulatedBRDF(values)


def test_round_trip_keeps_values_and_invalid_cells(table: TabulatedBRDF, tmp_path: Path) -> None:
    path = tmp_path / "x.binary"
    merl_file.write(path, table)
    assert path.stat().st_size == merl_file.SIZE
    back = merl_file.read(path)
    assert np.array_equal(back.values < 0, table.values < 0)
    assert np.allclose(back.values, table.values, rtol=1e-6)
    assert not list(tmp_path.glob("*.part"))


def test_independent_reader_reads_same_values(table: TabulatedBRDF, tmp_path: Path) -> None:
    """Byte arithmetic as in the database's own sample code."""
    path = tmp_path / "x.binary"
    merl_file.write(path, table)
    with open(path, "rb") as file:
        assert struct.unpack("<3i", file.read(12)) == (90, 90, 180)
        for ih, idx, ip in ((0, 0, 0), (3, 17, 101), (40, 5, 90)):
            place = ip + idx * 180 + ih * 180 * 90
            for channel, scale in enumerate((1 / 1500, 1.15 / 1500, 1.66 / 1500)):
                file.seek(12 + 8 * (place + channel * 90 * 90 * 180))
                value = struct.unpack("<d", file.read(8))[0]
                stored = table.values[channel, ih, idx, ip]
                assert np.isclose(value * scale, stored, rtol=1e-6) or value == stored == -1


@pytest.mark.parametrize("cut", [0, 5, 12, 1000, merl_file.SIZE - 1])
def test_truncated_files_are_rejected(table: TabulatedBRDF, tmp_path: Path, cut: int) -> None:
    path = tmp_path / "x.binary"
    merl_file.write(path, table)
    with open(path, "r+b") as file:
        file.truncate(cut)
    with pytest.raises(InputError, match=r"x\.binary") as error:
        merl_file.read(path)
    assert "\n" not in str(error.value)


def test_wrong_dimensions_and_missing_files_are_rejected(tmp_path: Path) -> None:
    path = tmp_path / "x.binary"
    path.write_bytes(np.array([90, 90, 360], "<i4").tobytes() + bytes(100))
    with pytest.raises(InputError, match="expected"):
        merl_file.read(path)
    with pytest.raises(InputError, match="cannot be read"):
        merl_file.read(tmp_path / "none.binary")


def test_interpolation_at_and_between_cell_centres(table: TabulatedBRDF) -> None:
    centres = merl_grid.node_angles(0.5)
    pick = (np.array([2, 30, 60]), np.array([10, 20, 15]), np.array([179, 0, 90]))
    at = type(centres)(*(a[pick] for a in centres))
    assert np.allclose(table.evaluate(at), table.values[(slice(None), *pick)].T, rtol=1e-4)
    assert np.allclose(table.nearest(at), table.values[(slice(None), *pick)].T)


def test_values_of_genuine_files_read_as_published(shared: Path, tmp_path: Path) -> None:
    """Raw values of genuine files, written at their index, are read as raw / 1500."""
    raw = np.loadtxt(shared / "data" / "brdf" / "real_merl_anchor_raw_rows.txt").reshape(3, 100)
    path = tmp_path / "genuine.binary"
    for row in raw:
        numbers = np.full(3 * merl_file.CELLS, -1.0)
        numbers[:100] = row  # θh = θd = 0, φd bins 0–99, red
        path.write_bytes(np.array([90, 90, 180], "<i4").tobytes() + numbers.astype("<f8").tobytes())
        table = merl_file.read(path)
        assert np.allclose(table.values[0, 0, 0, :100], row / 1500, rtol=1e-6)
        assert (table.values[1:, 0, 0, :100] == -1).all()
