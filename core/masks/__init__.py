"""Shadow masks computed from the geometry, and materials proposed from the photos."""
