"""``compare FIT.binary TRUTH``: how far two BRDFs are apart."""

from __future__ import annotations

import argparse
import json
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from ..core.brdf import TabulatedBRDF, merl_file, metrics, nbrdf
from ..core.errors import InputError

HELP = "differences of two BRDFs: relative L2, log-relative RMS, cube-root RMS"


def add_arguments(parser: argparse.ArgumentParser) -> None:
    parser.add_argument("fit", type=Path, help="a MERL .binary")
    parser.add_argument(
        "truth", type=Path, help="a MERL .binary, or a truth.json that holds a neural encoding"
    )
    parser.add_argument("--limit", type=float, default=80.0, help="degrees from the normal (80)")


def run(arguments: argparse.Namespace) -> None:
    if not 1.0 <= arguments.limit <= 90.0:
        raise InputError(f"found {arguments.limit:g}, expected 1 to 90 degrees", key="--limit")
    fit = merl_file.read(arguments.fit)
    found = metrics.compare(fit, read_truth(arguments.truth), arguments.limit)
    print(f"relative L2 (all cells in view)            {found.relative_l2:.4f}")
    print(f"log-relative RMS (to {found.limit:g} degrees)         {found.log_relative_rms:.4f}")
    print(f"cube-root cosine-weighted RMS (same)       {found.cube_root_rms:.4f}")


def read_truth(path: Path) -> TabulatedBRDF:
    """The table of a .binary, or of the encoding in a truth.json, at the cells' centres."""
    if path.suffix != ".json":
        return merl_file.read(path)
    weights = truth_weights(path)
    return TabulatedBRDF.from_function(lambda angles: nbrdf.evaluate(weights, angles))


def truth_weights(path: Path) -> NDArray[np.float32]:
    """(675,) the neural encoding in a truth.json. Raises InputError."""
    try:
        weights = np.array(json.loads(path.read_text("utf-8"))["weights"], np.float32)
    except (OSError, ValueError, KeyError, TypeError, RecursionError) as error:
        raise InputError(f"holds no neural encoding ({error})", file=path) from error
    if weights.shape != (nbrdf.WEIGHTS,):
        raise InputError(f"{weights.shape} weights, expected {nbrdf.WEIGHTS}", file=path)
    if not (np.abs(weights) < 1e6).all():
        raise InputError("the neural encoding has numbers beyond all measure", file=path)
    return weights
