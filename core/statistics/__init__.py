"""Robust statistics shared by fit, maps, masks and diagnosis."""
