"""Read the result of a fit (result.json) back into core types."""

from .fitted import FittedMaterial, FittedResult
from .reader import read_result

__all__ = ["FittedMaterial", "FittedResult", "read_result"]
