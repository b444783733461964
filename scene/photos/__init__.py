"""Photos, cameras and lamps in Blender."""
