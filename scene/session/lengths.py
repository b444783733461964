"""Lengths as panels tell them: in scan units, or in metres where the preferences say what a scan
unit is."""

from __future__ import annotations

import re

import bpy

from .preferences import preferences

METRES = {"METRES": 1.0, "CENTIMETRES": 0.01, "MILLIMETRES": 0.001}  # in a scan unit
TOLD = re.compile(r"(\d+(?:\.\d+)?(?:e[+-]?\d+)?) scan units?\b")


def length(units: float) -> str:
    """units: scan units."""
    metres = METRES.get(preferences().unit)
    if metres is None:
        return f"{units:.3g} scan units"
    return bpy.utils.units.to_string("METRIC", "LENGTH", units * metres, precision=3).strip()


def with_lengths(sentence: str) -> str:
    """A sentence of core's, which knows scan units only."""
    if preferences().unit not in METRES:
        return sentence
    return TOLD.sub(lambda found: length(float(found[1])), sentence)
