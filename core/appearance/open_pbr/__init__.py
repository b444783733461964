"""OpenPBR Surface as MaterialX's shaders compute it, and its fit to a BRDF."""
