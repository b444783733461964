"""Read a reconstruction tool's files as a Scan: mesh and cameras in one frame."""

from .camera import Camera, Pose
from .mesh import Mesh
from .reconstruction import Georeference, Reconstruction, Similarity
from .scan import Scan

__all__ = ["Camera", "Georeference", "Mesh", "Pose", "Reconstruction", "Scan", "Similarity"]
