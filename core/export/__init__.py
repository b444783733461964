"""Files for other programs, and what each of them cannot hold."""

from .losses import Loss, write_losses

__all__ = ["Loss", "write_losses"]
