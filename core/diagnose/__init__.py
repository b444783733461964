"""Diagnosis: find the causes of the residual, and correct the samples for them."""
