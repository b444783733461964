"""Build the embedded basis: ``python run.py headless build-basis NBRDF.npz --others NBRDF.npz``
writes assets/basis.

Input: the neural encodings of the 100 MERL materials, and of 25 others for the prior, by Sztrajman
et al. 2021 (MIT licence), which are not part of this repository. Only the mean, the reference, the
components and the coefficients of the encodings are kept.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from ..angles import Angles, merl_grid
from ..brdf import nbrdf
from ..errors import InputError
from .basis import Basis, Progress
from .training import BLOCK, DEFAULT_COUNT, train

PROVENANCE = (
    "Mean, reference and principal components (Nielsen's log mapping) of the neural encodings of "
    "the 100 MERL materials by Sztrajman, Rainer, Ritschel, Weyrich 2021 (asztr/Neural-BRDF, MIT "
    "licence), and the encodings' own coefficients. Computed by core/basis/build_default.py. "
    "Contains no MERL data."
)
OTHERS = (
    " The last 30 components and the further coefficients are those of %d other encodings of the "
    "same authors: measurements of the RGL database (Dupuy, Jakob 2018) and of Nielsen et al. 2015."
)


@dataclass(frozen=True)
class NeuralObservations:
    """Neural encodings as training columns. weights: (n, 675)."""

    weights: NDArray[np.float32]

    @property
    def columns(self) -> int:
        """Three for each material."""
        return 3 * len(self.weights)

    def cell_blocks(self) -> Iterator[tuple[Angles, NDArray[np.float32], float]]:
        """The MERL cells above the horizon, at their lower edges, where the encodings were
        sampled."""
        seen = merl_grid.visible(merl_grid.node_angles(0.5))
        edges = [a[seen] for a in merl_grid.node_angles(0.0)]
        for start in range(0, edges[0].size, BLOCK):
            part = Angles(*(a[start : start + BLOCK] for a in edges))
            yield part, self.at(part), start / edges[0].size

    def at(self, angles: Angles) -> NDArray[np.float32]:
        """ρ (columns, n) in 1/sr."""
        out = np.empty((self.columns, angles.theta_h.size), np.float32)
        for i, weights in enumerate(self.weights):
            out[3 * i : 3 * i + 3] = nbrdf.evaluate(weights, angles).T
        return out


def build(
    encodings: Path,
    exclude: Sequence[str] = (),
    progress: Progress = lambda stage, fraction: None,
    others: Path | None = None,
) -> Basis:
    """The basis of an .npz of encodings, without the materials named in ``exclude``. others: an
    .npz of encodings of materials that are not in the database, for the prior.

    Raises InputError for a file that is not one or has too few materials, ValueError for an unknown
    name.
    """
    names, weights = nbrdf.load(encodings)
    unknown = sorted(set(exclude) - set(names))
    if unknown:
        raise ValueError(f"unknown materials: {unknown}; expected names from the encodings")
    if 3 * (len(names) - len(exclude)) <= DEFAULT_COUNT:
        raise InputError(
            f"{len(names)} materials; expected enough for {DEFAULT_COUNT} components "
            "(three columns each)",
            file=encodings,
        )
    kept = [i for i, name in enumerate(names) if name not in exclude]
    note = f" Without {', '.join(sorted(exclude))}." if exclude else ""
    more = None if others is None else NeuralObservations(nbrdf.load(others)[1])
    if more is not None:
        note += OTHERS % len(more.weights)
    return train(
        NeuralObservations(weights[kept]), PROVENANCE + note, progress=progress, others=more
    )


def write_checksums(table: Path, target: Path) -> int:
    """Write names and SHA-256 sums of the genuine MERL files, from a CSV (file, size, sha256), as
    JSON; returns their number."""
    import csv
    import json

    with open(table, newline="", encoding="utf-8") as file:
        sums = {row["file"]: row["sha256"] for row in csv.DictReader(file)}
    target.write_text(json.dumps(sums, indent=0, sort_keys=True) + "\n", "utf-8")
    return len(sums)
