"""The forward model: what a photo should look like."""

from .photo import predict_radiance, similarity_sums

__all__ = ["predict_radiance", "similarity_sums"]
