"""Measured materials as assets, with tags and provenance."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import bpy

from ..property_keys import MEASURED_DATE, MEASURED_NAME, PROVENANCE
from .trait_offsets import movable, state


def mark(material: bpy.types.Material, result: dict[str, Any]) -> bool:
    """Mark a material as an asset, with tags and provenance.

    result: the content of the result.json that the material belongs to. Returns False if it does
    not contain the material.
    """
    name = material[MEASURED_NAME]
    own = next((m for m in result["materials"] if m["name"] == name), None)
    if own is None:
        return False
    origin = provenance(own, result, material.get(MEASURED_DATE, ""))
    if movable(material) and state(material):
        origin["changed"] = "traits changed after the fit"
    material[PROVENANCE] = origin
    material.asset_mark()
    data = material.asset_data
    data.description = "; ".join(origin.values())
    data.author = f"Patina {result['program']['version']}"
    for tag in ("Patina", "measured", name, Path(result["capture"]).name.split(".")[0]):
        data.tags.new(tag, skip_if_exists=True)
    return True


def provenance(material: dict[str, Any], result: dict[str, Any], date: str) -> dict[str, str]:
    """Sentences on scan, photos, date, version and error, by key.

    material: an entry of ``result["materials"]``; result: the content of result.json; date: ISO
    8601, "" if unknown.
    """
    photos = sum(count > 0 for count in material["samples"]["per_photo"].values())
    lights = [light["name"] for light in result["lights"]]
    sentences = {
        "scan": f"measured from {Path(result['capture']).name}",
        "photos": f"{photos} lit photos under {', '.join(lights)}",
        "date": f"on {date}" if date else "on an unknown date",
        "version": f"by Patina {result['program']['version']}, {material['estimator']} method",
    }
    held = material.get("held_out")
    if held:
        sentences["error"] = f"median error of held-out photos {100 * held['typical']:.1f} %"
    effects = [effect["cause"].replace("_", " ") for effect in result.get("effects", [])]
    if effects:
        sentences["effects"] = f"with {', '.join(effects)} included in the model"
    return sentences
