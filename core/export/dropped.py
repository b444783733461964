"""Inputs of a fitted Principled BSDF that a format cannot represent."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from ..appearance.principled import Principled


def dropped_inputs(principled: Principled, places: Mapping[str, str]) -> tuple[str, ...]:
    """The inputs of ``places`` (field → name of the socket) whose fitted values differ from the
    defaults of the node, each as "socket (value)"."""
    plain = Principled()
    found = []
    for field, socket in places.items():
        value, default = getattr(principled, field, None), getattr(plain, field, None)
        if value is None or default is None or np.allclose(value, default):
            continue
        if field.startswith("coat_") and principled.coat_weight == 0:
            continue
        shown = ", ".join(f"{v:.3g}" for v in np.atleast_1d(value))
        found.append(f"{socket} ({shown})")
    return tuple(found)
