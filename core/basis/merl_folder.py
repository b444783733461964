"""A basis from the user's own copy of the MERL database (research and academic use only)."""

from __future__ import annotations

import hashlib
import json
import os
import sys
from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from ..angles import Angles, merl_grid
from ..brdf import merl_file
from ..errors import InputError
from ..files import regular_size
from . import storage
from .basis import Basis, Progress
from .default_basis import default_basis
from .training import BLOCK, train

CHECKSUMS_FILE = Path(__file__).parents[2] / "assets" / "basis" / "merl_sha256.json"
VERSION = 3  # of the cache; increase it when the result of train() changes


@dataclass(frozen=True)
class MerlObservations:
    """Genuine MERL files as training columns, memory-mapped: memory does not grow with their
    number."""

    files: tuple[Path, ...]

    @property
    def columns(self) -> int:
        """Three for each file."""
        return 3 * len(self.files)

    def cell_blocks(self) -> Iterator[tuple[Angles, NDArray[np.float32], float]]:
        """The cells that are valid in every material, at their centres."""
        tables = self._tables()
        valid = np.ones(merl_file.CELLS, bool)
        for table in tables:
            valid &= (table >= 0).all(axis=0)
        cells = np.flatnonzero(valid)
        centres = [a.ravel() for a in merl_grid.node_angles(0.5)]
        for start in range(0, cells.size, BLOCK):
            part = cells[start : start + BLOCK]
            rho = np.concatenate([t[:, part] for t in tables]) * np.tile(
                merl_file.SCALE, len(tables)
            ).reshape(-1, 1)
            angles = Angles(*(a[part] for a in centres))
            yield angles, rho.astype(np.float32), start / cells.size

    def at(self, angles: Angles) -> NDArray[np.float32]:
        """ρ (columns, n) in 1/sr; −1 in all columns where one has no measurement."""
        out = np.empty((self.columns, angles.theta_h.size), np.float32)
        for i, file in enumerate(self.files):
            out[3 * i : 3 * i + 3] = merl_file.read(file).evaluate(angles).T
        out[:, (out < 0).any(axis=0)] = -1.0
        return out

    def _tables(self) -> list[NDArray[np.float64]]:
        """Memory-mapped (3, cells) values of each file, not scaled."""
        return [
            np.memmap(file, merl_file.VALUES, "r", offset=12, shape=(3, merl_file.CELLS))
            for file in self.files
        ]


@dataclass(frozen=True)
class OthersOf:
    """The measured materials that another basis knows and that are not in MERL, as it stores
    them."""

    basis: Basis

    @property
    def columns(self) -> int:
        """Three for each material."""
        return 0 if self.basis.others is None else len(self.basis.others)

    def at(self, angles: Angles) -> NDArray[np.float32]:
        """ρ (columns, n) in 1/sr."""
        assert self.basis.others is not None
        return np.ascontiguousarray(self.basis.evaluate(self.basis.others, angles).T)


def checksums() -> dict[str, str]:
    """File name → SHA-256 sum of the 100 genuine files."""
    return dict(json.loads(CHECKSUMS_FILE.read_text("utf-8")))


def check_files(
    folder: Path,
    expected: Mapping[str, str],
    progress: Progress = lambda stage, fraction: None,
) -> tuple[Path, ...]:
    """The files of the database. Raises InputError where one is missing, incomplete or not
    genuine."""
    if not folder.is_dir():
        raise InputError("folder not found; expected the MERL database", file=folder, key="--merl")
    missing = [name for name in expected if not (folder / name).is_file()]
    if missing:
        raise InputError(
            f"{len(missing)} of the {len(expected)} MERL files are missing; first {missing[0]}",
            file=folder,
            key="--merl",
        )
    for done, (name, digest) in enumerate(expected.items()):
        progress("checking the MERL files", done / len(expected))
        path = folder / name
        size = regular_size(path)
        if size != merl_file.SIZE:
            raise InputError(
                f"{size} bytes; expected {merl_file.SIZE}: the download is incomplete", file=path
            )
        with open(path, "rb") as file:
            if hashlib.file_digest(file, "sha256").hexdigest() != digest:
                raise InputError(
                    "is not the genuine MERL file (its SHA-256 sum differs); download it again",
                    file=path,
                )
    return tuple(folder / name for name in expected)


def cached_basis(
    folder: Path,
    progress: Progress = lambda stage, fraction: None,
    expected: Mapping[str, str] | None = None,
    cache: Path | None = None,
) -> Basis:
    """The basis of a MERL folder; computed once, then read from the user's cache.

    expected: file name → SHA-256 sum, None: checksums(). cache: folder, None: user_cache().
    """
    expected = checksums() if expected is None else expected
    files = check_files(folder, expected, progress)
    key = hashlib.sha256(f"{VERSION} {sorted(expected.items())}".encode()).hexdigest()[:16]
    cache = user_cache() if cache is None else cache
    stored = cache / f"merl_basis_{key}.npz"
    if stored.is_file():
        try:
            return storage.load(stored)
        except InputError:
            stored.unlink()  # a damaged cache file is computed anew
    others = OthersOf(default_basis())
    basis = train(
        MerlObservations(files),
        f"Principal components (Nielsen's log mapping) of {len(files)} MERL files "
        "(Matusik et al. 2003; for research and academic use), and the other materials of the "
        "embedded basis. Made on this computer.",
        progress=progress,
        others=others if others.columns else None,
    )
    cache.mkdir(parents=True, exist_ok=True)
    storage.save(stored, basis)
    return storage.load(stored)  # rounded as in later runs: results record the basis version


def user_cache() -> Path:
    """The user's cache folder for Patina (PATINA_CACHE, or the system's convention)."""
    if chosen := os.environ.get("PATINA_CACHE"):
        return Path(chosen)
    if sys.platform == "win32":
        return Path(os.environ.get("LOCALAPPDATA", Path.home() / "AppData/Local")) / "patina"
    if sys.platform == "darwin":
        return Path.home() / "Library" / "Caches" / "patina"
    return Path(os.environ.get("XDG_CACHE_HOME", Path.home() / ".cache")) / "patina"
