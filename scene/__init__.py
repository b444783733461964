"""Conversion between Blender data and the types of core. Only this package and its users import
bpy."""
