"""Helpers shared by the readers: bounded file access, labels, photo sizes, sparse points."""
