"""Principal components of measured reflectance: the embedded basis, or one from a MERL folder."""

from . import storage
from .basis import Basis
from .default_basis import default_basis
from .grid import AngleGrid
from .principal_brdf import PrincipalBRDF

__all__ = ["AngleGrid", "Basis", "PrincipalBRDF", "default_basis", "storage"]
