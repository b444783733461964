"""From a BRDF to representations for Blender and other programs: OSL shader, Principled BSDF, lobe
stack, tables for sampling."""
