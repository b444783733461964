"""The BRDF as arrays (table, coefficients and basis), in EXR images or NPZ archives."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ..angles import merl_grid
from ..basis import AngleGrid, Basis, PrincipalBRDF
from ..basis.mapping import EPSILON
from ..brdf import TabulatedBRDF
from ..files import atomic_path
from ..photo import write_exr
from ..result import FittedMaterial
from .file_names import identifier

EXR_README, NPZ_README = "README_exr.txt", "README_npz.txt"


def table_pixels(table: TabulatedBRDF) -> NDArray[np.float32]:
    """(8100, 180, 3): row 90·ih + id, column ip; invalid cells −1."""
    n_h, n_d, n_p = merl_grid.SHAPE
    return np.moveaxis(table.values, 0, -1).reshape(n_h * n_d, n_p, 3)


def write_exr_material(folder: Path, material: FittedMaterial, table: TabulatedBRDF) -> list[str]:
    """Write NAME_table.exr and NAME_coefficients.exr; returns their names."""
    name = identifier(material.name)
    write_exr(
        folder / f"{name}_table.exr",
        table_pixels(table),
        description="BRDF in 1/sr at the centres of the MERL cells; row 90*ih + id, column ip; "
        "-1: invalid",
    )
    write_exr(
        folder / f"{name}_coefficients.exr",
        material.brdf.coefficients.T[None],
        description=f"coefficients in the basis {material.brdf.basis.version}, one column a "
        "component",
    )
    return [f"{name}_table.exr", f"{name}_coefficients.exr"]


def write_exr_basis(folder: Path, basis: Basis) -> str:
    """Write basis_VERSION.exr, slabs of n_h rows: µ, ln(ref + ε), then the components. Returns its
    name."""
    n_h, n_d, n_p = basis.grid.shape
    slabs = np.concatenate([basis.mean[None], basis.log_reference[None], basis.components])
    name = f"basis_{basis.version}.exr"
    write_exr(
        folder / name,
        slabs.reshape(-1, n_d * n_p, 1),
        channels="Y",
        description=f"{len(slabs)} slabs of {n_h} rows (theta_h); column {n_p}*id + ip; "
        f"see {EXR_README}",
    )
    return name


def write_npz_material(folder: Path, material: FittedMaterial, table: TabulatedBRDF) -> str:
    """Write NAME.npz: table, log table, coefficients and the nodes' angles; returns its name."""
    name = f"{identifier(material.name)}.npz"
    write_npz(
        folder / name,
        name=np.array(material.name),
        table=table.values,
        **log_table_arrays(material.brdf),
        coefficients=material.brdf.coefficients,
        basis_version=np.array(material.brdf.basis.version),
        scale_known=np.array(material.scale_known),
        scale=np.array(material.scale),
    )
    return name


def log_table_arrays(brdf: PrincipalBRDF) -> dict[str, NDArray[Any]]:
    """ln(ρ·cosMap + ε) at the nodes of the basis, (n_h, n_d, n_p, 3), and the nodes' angles."""
    grid = brdf.basis.grid
    return {"log_table": brdf.log_table.values.reshape(*grid.shape, 3), **node_arrays(grid)}


def node_arrays(grid: AngleGrid) -> dict[str, NDArray[Any]]:
    """The angles of a grid's nodes along each axis, and the constants of the mapping."""
    nodes = grid.nodes()
    return {
        "theta_h": nodes.theta_h[:, 0, 0],
        "theta_d": nodes.theta_d[0, :, 0],
        "phi_d": nodes.phi_d[0, 0, :],
        "knee": np.array(grid.knee),
        "epsilon": np.array(EPSILON),
    }


def write_npz_basis(folder: Path, basis: Basis) -> str:
    """Write basis_VERSION.npz: µ, ln(ref + ε), components and nodes; returns its name."""
    name = f"basis_{basis.version}.npz"
    write_npz(
        folder / name,
        mean=basis.mean,
        log_reference=basis.log_reference,
        components=basis.components,
        explained=basis.explained,
        **node_arrays(basis.grid),
        provenance=np.array(basis.provenance),
    )
    return name


def write_npz(path: Path, **arrays: NDArray[Any]) -> None:
    """Write a compressed .npz atomically: a failed write leaves no partial file."""
    with atomic_path(path) as partial, open(partial, "wb") as file:
        np.savez_compressed(file, **arrays)
