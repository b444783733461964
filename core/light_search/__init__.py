"""Find unknown lights from the lit photos: direction, position or flash offset, with standard
errors."""

from .lamp_photo import LampPhoto, draw_lamp_pixels
from .search import FoundLamp, FoundLamps, UnknownLamp, find_lamps

__all__ = [
    "FoundLamp",
    "FoundLamps",
    "LampPhoto",
    "UnknownLamp",
    "draw_lamp_pixels",
    "find_lamps",
]
