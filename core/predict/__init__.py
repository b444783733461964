"""The forward model: the photo expected from geometry, light and BRDF."""

from .photo import predict_radiance, similarity_sums

__all__ = ["predict_radiance", "similarity_sums"]
