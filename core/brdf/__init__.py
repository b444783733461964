"""Reflectance as tables, as MERL files, as published encodings and as analytic lobes."""

from .table import TabulatedBRDF

__all__ = ["TabulatedBRDF"]
