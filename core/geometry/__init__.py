"""Ray casting, visibility, shadows and curvature of the scanned surface (Embree through
embreex)."""

from .pixel_rays import PixelRays
from .rays import RayScene
from .view import SurfaceView, view_surface, view_window
from .window import Window, bands

__all__ = [
    "PixelRays",
    "RayScene",
    "SurfaceView",
    "Window",
    "bands",
    "view_surface",
    "view_window",
]
