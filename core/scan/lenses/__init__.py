"""Lens models that COLMAP lacks, and the choice of the exact model for a tool's distortion."""
