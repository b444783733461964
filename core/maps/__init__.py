"""Maps over the mesh's UVs: base colour without light, roughness, coverage, materials' shares."""

from .maps_job import MapsJob, MapsSettings
from .texels import Texels, rasterise

__all__ = ["MapsJob", "MapsSettings", "Texels", "rasterise"]
