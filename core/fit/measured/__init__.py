"""Patina's own estimator: every sample, all components, normals and BRDF together."""

from .estimate import MeasuredFit, MeasuredSettings, fit_measured

__all__ = ["MeasuredFit", "MeasuredSettings", "fit_measured"]
