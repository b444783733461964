"""Readers of mesh files: one module for each format. Every declared count is checked against the
size of the file before it is used."""

from .polygons import Polygons

__all__ = ["Polygons"]
