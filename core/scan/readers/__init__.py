"""One reader a format of a reconstruction tool; formats.py says which reads what."""
