"""``basis --merl FOLDER``: compute a basis from the user's own MERL files and cache it."""

from __future__ import annotations

import argparse
from pathlib import Path

from ..core.basis import storage
from ..core.basis.merl_folder import cached_basis
from ..core.concurrency.job import Step
from ..core.output_folder import staged_folder
from .progress import Progress

HELP = "compute the principal components of your own copy of the MERL database"


def add_arguments(parser: argparse.ArgumentParser) -> None:
    parser.add_argument(
        "--merl", type=Path, required=True, help="folder with the 100 .binary files"
    )
    parser.add_argument("--out", type=Path, help="folder for a copy of the basis, basis.npz")


def run(arguments: argparse.Namespace) -> None:
    progress = Progress()
    basis = cached_basis(arguments.merl, lambda stage, done: progress(Step(stage, done)))
    explained = basis.explained.cumsum()
    print(f"basis {basis.version}: {basis.count} components of {basis.columns} columns")
    for k in (1, 2, 3, 5, 10, 20):
        print(f"  {k:2d} components explain {100 * explained[k - 1]:.2f} % of the variance")
    if arguments.out is not None:
        with staged_folder(arguments.out) as folder:
            storage.save(folder / "basis.npz", basis)
        print(f"wrote {arguments.out / 'basis.npz'}")
