"""What belongs to which material, where the scan itself says so."""

from .face_materials import faces_by_texture, faces_by_vertex_colour

__all__ = ["faces_by_texture", "faces_by_vertex_colour"]
