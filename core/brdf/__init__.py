"""BRDFs as tables, MERL files and published neural encodings, and error metrics between BRDFs."""

from .table import TabulatedBRDF

__all__ = ["TabulatedBRDF"]
