"""How materials vary over the surface: read from the photos, chosen, and estimated."""
