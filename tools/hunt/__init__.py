"""Simulated captures with a hidden effect, to test whether `diagnose` finds it."""
