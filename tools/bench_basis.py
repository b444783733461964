"""Measure the embedded basis: explained variance, interpolation error, held-out materials."""

from __future__ import annotations

import time
from pathlib import Path

import numpy as np

# Nielsen et al. 2015, five published directions: φd, θh, θd in degrees
NIELSEN_5 = (
    (36.2, 1.4, 4.0),
    (86.5, 76.7, 13.1),
    (85.5, 7.6, 78.9),
    (144.8, 2.5, 73.8),
    (80.4, 12.9, 51.6),
)
# ρ·cosMap + ε, lower limits of the bins in which the basis' error is measured
LEVELS = (0.001, 0.0015, 0.002, 0.003, 0.005, 0.01, 0.02, 0.05, 0.1, 0.2, 0.5, 1.0)


def run(data: Path) -> None:
    """Print the tables of docs/method/measurements.md, section "The basis".

    data: folder of the reference data.
    """
    from patina.core.angles import Angles, cosines, merl_grid
    from patina.core.basis import PrincipalBRDF, default_basis
    from patina.core.basis.build_default import NeuralObservations
    from patina.core.basis.training import DEFAULT_COUNT, exact_rows, principal
    from patina.core.brdf import TabulatedBRDF, metrics, nbrdf

    print("## basis\n")
    basis = default_basis()
    observations = NeuralObservations(nbrdf.load(data / "brdf" / "nbrdf_merl.npz")[1])
    start = time.perf_counter()
    found = principal(observations, DEFAULT_COUNT)
    directions, explained = found.weights, found.explained
    print(f"principal components of 300 columns: {time.perf_counter() - start:.1f} s")
    total = explained.cumsum()
    shares = ", ".join(f"{k}: {100 * total[k - 1]:.1f} %" for k in (1, 2, 3, 5, 10, 20, 40))
    print(f"variance explained by components {shares}")

    centres = merl_grid.node_angles(0.5)
    cos_i, cos_o = cosines(*centres)
    rng = np.random.default_rng(1)
    for limit in (80, 90):
        visible = np.flatnonzero((np.minimum(cos_i, cos_o) > np.cos(np.radians(limit))).ravel())
        pick = rng.choice(visible, 60_000, replace=False)
        angles = Angles(*(a.ravel()[pick] for a in centres))
        exact = exact_rows(observations, directions, angles)
        centre, rows = basis.rows(angles, DEFAULT_COUNT)
        difference = (centre[:, None] + rows @ directions.T.astype(np.float32)) - (
            (exact[0] + exact[1])[:, None] + exact[2:].T @ directions.T.astype(np.float32)
        )
        per_column = np.sqrt(np.mean(difference**2, axis=0))
        print(
            f"interpolating the embedded grid {basis.grid.shape}, to {limit} degrees: log-relative "
            f"RMS {np.sqrt(np.mean(difference**2)):.4f} (median material "
            f"{np.median(per_column):.4f}, worst {per_column.max():.4f})"
        )

    directions5 = np.radians(NIELSEN_5)
    rows5 = basis.rows(Angles(directions5[:, 1], directions5[:, 2], directions5[:, 0]), 5)[1]
    print(f"condition number of Nielsen's published five directions: {np.linalg.cond(rows5):.2f}")

    print("\nvalidation materials (not in MERL) projected onto k components, to 80 degrees\n")
    print("| material | log RMS k=5 | k=20 | k=40 | cube-root RMS k=5 | k=20 | k=40 |")
    print("|---|---|---|---|---|---|---|")
    names, weights = nbrdf.load(data / "brdf" / "nbrdf_validation.npz")
    rows_out = []
    squares = [np.zeros(len(LEVELS)), np.zeros(len(LEVELS))]
    for name, w in zip(names, weights, strict=True):
        truth = TabulatedBRDF.from_function(lambda angles, w=w: nbrdf.evaluate(w, angles))
        valid = truth.valid
        near = valid & (np.minimum(cos_i, cos_o) > np.cos(np.radians(80)))
        angles = Angles(*(a[near] for a in centres))
        rho = np.moveaxis(truth.values, 0, -1)[near]
        found = []
        for k in (5, 20, 40):
            fit = PrincipalBRDF(basis, basis.project(rho, angles, k))
            found.append(metrics.compare(fit.table(), truth))
        _add_squares(squares, fit.evaluate(angles), rho, angles)
        figures = [f.log_relative_rms for f in found] + [f.cube_root_rms for f in found]
        rows_out.append(figures)
        print(f"| {name} | " + " | ".join(f"{x:.3f}" for x in figures) + " |", flush=True)
    median = np.median(rows_out, axis=0)
    print("| **median** | " + " | ".join(f"{x:.3f}" for x in median) + " |\n")
    print("error by level ρ·cosMap + ε of these materials, k=40\n")
    print("| level from | RMS error of its logarithm | noise model of the fit |")
    print("|---|---|---|")
    for level, error, model in _errors_by_level(squares):
        print(f"| {level:.4g} | {error:.3f} | {model:.3f} |")


def _add_squares(squares, found, rho, angles) -> None:  # type: ignore[no-untyped-def]
    """Add (sums of squared errors of ln(ρ·cosMap + ε), counts) by bins of the level."""
    from patina.core.basis import mapping

    weight = mapping.cos_map(angles)[:, None]
    level = np.maximum(rho, 0) * weight + mapping.EPSILON
    error = np.log((np.maximum(found, 0) * weight + mapping.EPSILON) / level)
    place = np.clip(np.searchsorted(LEVELS, level.ravel(), side="right") - 1, 0, None)
    squares[0] += np.bincount(place, error.ravel() ** 2, len(LEVELS))
    squares[1] += np.bincount(place, minlength=len(LEVELS))


def _errors_by_level(squares):  # type: ignore[no-untyped-def]
    """(lower limit of the level, RMS error, standard deviation of the noise model) of each bin."""
    from patina.core.noise.basis_error import basis_variance

    for k, level in enumerate(LEVELS):
        upper = LEVELS[k + 1] if k + 1 < len(LEVELS) else 3 * level
        model = np.sqrt(basis_variance(np.array(np.sqrt(level * upper))))
        yield level, np.sqrt(squares[0][k] / max(squares[1][k], 1)), float(model)
