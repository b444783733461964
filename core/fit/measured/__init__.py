"""Patina's own estimator: every sample and all components, normals and BRDF estimated together."""

from .estimate import MeasuredFit, MeasuredSettings, fit_measured

__all__ = ["MeasuredFit", "MeasuredSettings", "fit_measured"]
