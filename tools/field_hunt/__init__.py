"""Captures of scans as they are, with and without a hidden effect, to test the diagnosis."""
