"""Find the basis of a result's coefficients by its version."""

from __future__ import annotations

from pathlib import Path

from ..basis import Basis, default_basis, storage
from ..basis.merl_folder import user_cache
from ..errors import InputError
from ..scan.parsing.json_record import shown

MAX_BASIS_BYTES = 256 << 20  # the embedded basis has 6 MB
MAX_CACHED_BASES = 32  # files looked at in the cache


def basis_of_version(version: str, file: Path, cache: Path | None = None) -> Basis:
    """The basis with this version: the embedded one, or one built from the user's own MERL files.

    file: the result that needs it, for the error message. cache: folder of the user's bases
    (default: the user's cache). Raises InputError where this computer has no such basis.
    """
    default = default_basis()
    if default.version == version:
        return default
    folder = user_cache() if cache is None else cache
    for stored in _cached(folder):
        try:
            basis = storage.load(stored)
        except InputError:
            continue  # ignore a damaged cache file
        if basis.version == version:
            return basis
    raise InputError(
        f"is {shown(version)}; expected {default.version}, the basis of this version of Patina, "
        "or a basis in the cache; run `basis --merl FOLDER` if the fit used your own MERL files, "
        "otherwise fit again",
        file=file,
        key="basis.version",
    )


def _cached(folder: Path) -> list[Path]:
    try:
        found = sorted(folder.glob("merl_basis_*.npz"))[:MAX_CACHED_BASES]
        return [path for path in found if path.is_file() and path.stat().st_size <= MAX_BASIS_BYTES]
    except OSError:
        return []
