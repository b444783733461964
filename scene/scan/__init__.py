"""The scan in Blender: mesh, origin, faces of each material, rays."""
