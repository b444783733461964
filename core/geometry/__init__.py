"""Rays, visibility, shadows and curvature of the scanned surface (Embree through embreex)."""

from .rays import RayScene
from .view import SurfaceView, view_surface

__all__ = ["RayScene", "SurfaceView", "view_surface"]
