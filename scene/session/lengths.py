"""Lengths in panels: in scan units, or in metric units if the preferences define the scan unit."""

from __future__ import annotations

import re

import bpy

from .preferences import preferences

METRES = {"METRES": 1.0, "CENTIMETRES": 0.01, "MILLIMETRES": 0.001}  # per scan unit
LENGTH_IN_SCAN_UNITS = re.compile(r"(\d+(?:\.\d+)?(?:e[+-]?\d+)?) scan units?\b")


def length(units: float) -> str:
    """A length as text; units: the length in scan units."""
    metres = METRES.get(preferences().unit)
    if metres is None:
        return f"{units:.3g} scan units"
    return bpy.utils.units.to_string("METRIC", "LENGTH", units * metres, precision=3).strip()


def with_lengths(sentence: str) -> str:
    """A sentence of core, which uses scan units, with its lengths in the preferred unit."""
    if preferences().unit not in METRES:
        return sentence
    return LENGTH_IN_SCAN_UNITS.sub(lambda found: length(float(found[1])), sentence)
