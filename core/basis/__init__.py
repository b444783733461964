"""Principal components of measured reflectance: the embedded default, or one from a MERL folder."""

from . import storage
from .basis import Basis, PrincipalBRDF
from .grid import AngleGrid

__all__ = ["AngleGrid", "Basis", "PrincipalBRDF", "storage"]
