"""The tables of the OSL shader of one material."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from ..basis import PrincipalBRDF
from . import sampling_table
from .closure_split import ClosureSplit, split


@dataclass(frozen=True)
class ShaderTables:
    """Tables of one shader. parts: the split into closures; texels: the sampling table as the
    pixels of its EXR."""

    parts: ClosureSplit
    texels: NDArray[np.float32]

    @classmethod
    def of(cls, brdf: PrincipalBRDF) -> ShaderTables:
        """Compute the tables of a BRDF, in about a second."""
        parts = split(brdf.evaluate)
        table = sampling_table.sampling_table(brdf.evaluate, parts)
        return cls(parts, sampling_table.texels(parts, table))
