"""Which effects are accepted: score test, significance, cross-validation, search."""
