"""Export to files of other programs, with the error of each format."""

from .losses import Loss, write_losses

__all__ = ["Loss", "write_losses"]
