"""The models of a material as tables of logarithms, and its 90 % interval, for the viewer."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from ..angles import Angles
from ..basis import AngleGrid, PrincipalBRDF, mapping

INTERVAL_STEP = 0.02  # of ln factor, of one unit of the stored interval
MAX_LOG = 11.0  # half floats end at ln(65504)

Evaluate = Callable[[Angles], NDArray[np.floating]]


@dataclass(frozen=True)
class ViewerMaterial:
    """tables: name of a model ("measured", "lobes", "principled") → (grid.size, 3) float16, ln(ρ ·
    cosMap + ε) at the nodes. interval: (grid.size,) uint8, ln of the factor of the 90 % interval in
    units of INTERVAL_STEP, mean of the channels; None where it is not known. body: level of the
    diffuse body in 1/sr, by which a BRDF that varies is split (core/varying/split.py); None where
    the material is even."""

    name: str
    grid: AngleGrid
    tables: Mapping[str, NDArray[np.float16]]
    interval: NDArray[np.uint8] | None = None
    body: tuple[float, float, float] | None = None

    @classmethod
    def of(
        cls,
        name: str,
        brdf: PrincipalBRDF,
        models: Mapping[str, Evaluate],
        factor: Evaluate | None = None,
        body: tuple[float, float, float] | None = None,
    ) -> ViewerMaterial:
        """models: further models by name, functions angles → ρ (n, 3) in 1/sr. factor: function
        angles → (n, 3) factor by which the BRDF may be larger or smaller."""
        grid = brdf.basis.grid
        nodes = Angles(*(a.ravel() for a in grid.nodes()))
        weight = mapping.cos_map(nodes)
        tables = {"measured": brdf.log_table.values}
        for model, evaluate in models.items():
            tables[model] = mapping.log_weighted(np.nan_to_num(evaluate(nodes)), weight)
        interval = None
        if factor is not None:
            steps = np.log(factor(nodes)).mean(axis=1) / INTERVAL_STEP
            interval = np.clip(np.round(steps), 0, 255).astype(np.uint8)
        halves = {name: np.minimum(t, MAX_LOG).astype(np.float16) for name, t in tables.items()}
        return cls(name, grid, halves, interval, body)
