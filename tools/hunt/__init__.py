"""Captures with a hidden effect, and whether `diagnose` finds it."""
