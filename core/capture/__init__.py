"""Read and write capture files, which name everything that a fit needs."""

from .entries import (
    ChartEntry,
    FitOptions,
    LightEntry,
    MaterialEntry,
    PhotoEntry,
    SphereEntry,
    SunEntry,
    ToneEntry,
    WhiteEntry,
)
from .model import Capture, ScanEntry
from .reader import read_capture

__all__ = [
    "Capture",
    "ChartEntry",
    "FitOptions",
    "LightEntry",
    "MaterialEntry",
    "PhotoEntry",
    "ScanEntry",
    "SphereEntry",
    "SunEntry",
    "ToneEntry",
    "WhiteEntry",
    "read_capture",
]
