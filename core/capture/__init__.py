"""The capture file: everything a fit needs, by name."""

from .model import Capture, FitOptions, MaterialEntry, PhotoEntry
from .reader import read_capture

__all__ = ["Capture", "FitOptions", "MaterialEntry", "PhotoEntry", "read_capture"]
