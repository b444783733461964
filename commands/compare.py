"""``compare FIT.binary TRUTH``: print the differences between two BRDFs."""

from __future__ import annotations

import argparse
import json
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from ..core.brdf import TabulatedBRDF, merl_file, metrics, nbrdf
from ..core.errors import InputError
from ..core.files import read_regular

MAX_TRUTH_BYTES = 1 << 20  # of a truth.json: 675 numbers are 20 kB
HELP = "print the differences between two BRDFs: relative L2, log-relative and cube-root RMS"


def add_arguments(parser: argparse.ArgumentParser) -> None:
    parser.add_argument("fit", type=Path, help="a MERL .binary file")
    parser.add_argument(
        "truth", type=Path, help="a MERL .binary file, or a truth.json with a neural encoding"
    )
    parser.add_argument(
        "--limit", type=float, default=80.0,
        help="largest angle of light and view from the normal, degrees (default %(default)g)",
    )  # fmt: skip


def run(arguments: argparse.Namespace) -> None:
    if not 1.0 <= arguments.limit <= 90.0:
        raise InputError(f"found {arguments.limit:g}, expected 1 to 90 degrees", key="--limit")
    fit = merl_file.read(arguments.fit)
    found = metrics.compare(fit, read_truth(arguments.truth), arguments.limit)
    print(f"relative L2 (all visible cells)            {found.relative_l2:.4f}")
    print(f"log-relative RMS (to {found.limit:g} degrees)         {found.log_relative_rms:.4f}")
    print(f"cube-root cosine-weighted RMS (same cells) {found.cube_root_rms:.4f}")


def read_truth(path: Path) -> TabulatedBRDF:
    """Return the table of a .binary file, or the neural encoding of a truth.json evaluated at the
    cell centres of the MERL grid. Raises InputError."""
    if path.suffix != ".json":
        return merl_file.read(path)
    weights = truth_weights(path)
    return TabulatedBRDF.from_function(lambda angles: nbrdf.evaluate(weights, angles))


def truth_weights(path: Path) -> NDArray[np.float32]:
    """Return the weights (675,) of the neural encoding in a truth.json. Raises InputError."""
    try:
        weights = np.array(json.loads(read_regular(path, MAX_TRUTH_BYTES))["weights"], np.float32)
    except (OSError, ValueError, KeyError, TypeError, RecursionError) as error:
        raise InputError(f"contains no neural encoding ({error})", file=path) from error
    if weights.shape != (nbrdf.WEIGHTS,):
        raise InputError(
            f"found weights of shape {weights.shape}, expected {nbrdf.WEIGHTS} values", file=path
        )
    if not (np.abs(weights) < 1e6).all():
        raise InputError(
            "the neural encoding has weights of 1e6 or more, or not finite; expected smaller ones",
            file=path,
        )
    return weights
