"""Readers of camera files: one module for each reconstruction tool's format."""
