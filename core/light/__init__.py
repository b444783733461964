"""Direction and irradiance of the light."""

from .distant import DistantLight

__all__ = ["DistantLight"]
