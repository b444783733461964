"""Which photo would say most about a material, of those that can be taken next."""

from .propose import NextPhoto, propose
from .sought import SoughtDirections

__all__ = ["NextPhoto", "SoughtDirections", "propose"]
