"""Reflectance samples with the accepted effects removed."""
