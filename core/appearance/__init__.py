"""From a BRDF to what Blender can show and other programs can read."""
