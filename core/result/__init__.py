"""Results of a fit, read back: what result.json says, as core types."""

from .fitted import FittedMaterial, FittedResult
from .reader import read_result

__all__ = ["FittedMaterial", "FittedResult", "read_result"]
