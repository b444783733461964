"""Which photo would say most about the materials, of those that can be taken next."""

from .proposal import ProposedPhoto
from .propose import MaterialToPhotograph, propose
from .uncertainty import DirectionUncertainty

__all__ = ["DirectionUncertainty", "MaterialToPhotograph", "ProposedPhoto", "propose"]
