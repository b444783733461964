"""Stepped jobs, thread pools and background steps that every long task shares."""
