"""Measured materials in Blender: nodes, shader files, traits, assets."""
