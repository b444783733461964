"""What a reconstruction tool wrote, as a Scan: mesh and cameras in one frame. One reader a file."""

from .camera import Camera, Pose
from .mesh import Mesh
from .scan import Scan

__all__ = ["Camera", "Mesh", "Pose", "Scan"]
