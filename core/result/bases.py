"""The basis that a result's coefficients are in, found by its version."""

from __future__ import annotations

from pathlib import Path

from ..basis import Basis, default_basis, storage
from ..basis.merl_folder import user_cache
from ..errors import InputError
from ..scan.parsing.json_record import shown

LARGEST = 256 << 20  # bytes; the embedded basis has 6 MB
MOST_CACHED = 32


def basis_of_version(version: str, file: Path, cache: Path | None = None) -> Basis:
    """The embedded basis, or one from the user's own MERL files, whose version is ``version``.

    file: the result that asks, for the message. Raises InputError where this computer has no such
    basis, with what to do about it.
    """
    default = default_basis()
    if default.version == version:
        return default
    folder = user_cache() if cache is None else cache
    for stored in _cached(folder):
        try:
            basis = storage.load(stored)
        except InputError:
            continue  # a damaged cache is none
        if basis.version == version:
            return basis
    raise InputError(
        f"is {shown(version)}; this Patina carries the basis {default.version} and finds no "
        "other here: run `basis --merl FOLDER` if the fit used MERL files of your own, else fit "
        "again",
        file=file,
        key="basis.version",
    )


def _cached(folder: Path) -> list[Path]:
    try:
        found = sorted(folder.glob("merl_basis_*.npz"))[:MOST_CACHED]
        return [path for path in found if path.is_file() and path.stat().st_size <= LARGEST]
    except OSError:
        return []
