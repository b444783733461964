"""Painting of materials and masks on the mesh and on photos."""
