"""Calibration from the photos themselves: tone curve from a chart, positions of lights."""
