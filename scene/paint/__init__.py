"""Masks and materials painted on the mesh and on photos."""
