"""Half/difference coordinates of Rusinkiewicz and the MERL grid over them."""

from .half_difference import (
    Angles,
    cosines,
    fold_phi_d,
    half_difference,
    light_view,
)

__all__ = ["Angles", "cosines", "fold_phi_d", "half_difference", "light_view"]
