"""Direction and irradiance of the light."""

from .distant import DistantLight
from .incidence import Incidence, Light
from .near import MountedLight, NearLight

__all__ = ["DistantLight", "Incidence", "Light", "MountedLight", "NearLight"]
