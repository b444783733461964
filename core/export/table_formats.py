"""Export of the BRDF as tables: MERL `.binary`, EXR and NPZ."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

from ..brdf import merl_file
from . import conventions, table_files
from .losses import Loss
from .subject import Subject

# keys of losses.json: how a program interpolates the table
INTERPOLATED = "read between the cells' centres"
NEAREST_CELL = "read as the value of the cell, as many programs do"
NO_COEFFICIENTS = "the coefficients and the basis; a result cannot be restored from the table"


def write_binary(folder: Path, subjects: Sequence[Subject]) -> list[Loss]:
    """Write NAME.binary in the MERL format."""
    losses = []
    for subject in subjects:
        file = f"{subject.name}.binary"
        merl_file.write(folder / file, subject.table)
        losses.append(
            Loss(
                "binary",
                subject.name,
                (file,),
                _table_errors(subject),
                dropped=(NO_COEFFICIENTS,),
                notes=(
                    "Cells hold the value at their centre. Programs that take it as the value at "
                    "the lower edge (as some readers of MERL do) shift the highlight by half a "
                    "cell.",
                    *subject.scale_note,
                ),
            )
        )
    return losses


def write_exr(folder: Path, subjects: Sequence[Subject]) -> list[Loss]:
    """Write table, coefficients and basis as EXR images, and README_exr.txt."""
    basis = subjects[0].material.brdf.basis
    shared = (
        table_files.write_exr_basis(folder, basis),
        conventions.write_readme(folder, "exr", basis),
    )
    losses = []
    for subject in subjects:
        own = table_files.write_exr_material(folder, subject.material, subject.table)
        errors = {**_table_errors(subject), "from coefficients and basis": 0.0}
        losses.append(Loss("exr", subject.name, (*own, *shared), errors, notes=subject.scale_note))
    return losses


def write_npz(folder: Path, subjects: Sequence[Subject]) -> list[Loss]:
    """Write table, coefficients, basis and the log table as NumPy archives, and README_npz.txt."""
    basis = subjects[0].material.brdf.basis
    shared = (
        table_files.write_npz_basis(folder, basis),
        conventions.write_readme(folder, "npz", basis),
    )
    losses = []
    for subject in subjects:
        own = table_files.write_npz_material(folder, subject.material, subject.table)
        errors = {"log_table, or coefficients and basis": 0.0}
        errors |= {f"table, {what}": error for what, error in _table_errors(subject).items()}
        losses.append(Loss("npz", subject.name, (own, *shared), errors, notes=subject.scale_note))
    return losses


def _table_errors(subject: Subject) -> dict[str, float]:
    """Errors of the MERL table, by how a program interpolates it."""
    table = subject.table
    return {INTERPOLATED: subject.error(table.evaluate), NEAREST_CELL: subject.error(table.nearest)}
