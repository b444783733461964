"""Lights: direction, position, irradiance and intensity, and how they are measured."""

from .distant import DistantLight
from .incidence import Incidence, Light
from .near import MountedLight, NearLight

__all__ = ["DistantLight", "Incidence", "Light", "MountedLight", "NearLight"]
