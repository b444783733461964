"""Texture maps over the UVs of the mesh: base colour without lighting, roughness, coverage, and
the share of each material."""

from .maps_job import MapsJob, MapsSettings
from .texels import Texels, rasterise

__all__ = ["MapsJob", "MapsSettings", "Texels", "rasterise"]
