"""Mesh files → polygons: one reader a format, none of which believes a count it has not checked."""

from .polygons import Polygons

__all__ = ["Polygons"]
