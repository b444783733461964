"""Shadow masks from geometry, and materials proposed from the photos."""
