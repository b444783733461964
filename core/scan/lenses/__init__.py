"""Lenses that COLMAP has no exact model for, and the choice of the simplest exact model."""
