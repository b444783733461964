"""Image files → linear radiance, and masks."""

from .image import read_encoded, read_mask, read_radiance, write_exr, write_png
from .rectify import rectify

__all__ = ["read_encoded", "read_mask", "read_radiance", "rectify", "write_exr", "write_png"]
