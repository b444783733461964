"""Estimators: reflectance samples → coefficients in a basis."""

from .paper import PaperFit, PaperSettings, fit_paper

__all__ = ["PaperFit", "PaperSettings", "fit_paper"]
