"""A measured material that is found again, with where it comes from."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import bpy

from ..property_keys import MEASURED_DATE, MEASURED_NAME, PROVENANCE
from .trait_offsets import movable, state


def mark(material: bpy.types.Material, result: dict[str, Any]) -> bool:
    """As an asset, with tags and provenance; result: the content of result.json that it is in.
    False where that does not know the material."""
    name = material[MEASURED_NAME]
    mine = next((m for m in result["materials"] if m["name"] == name), None)
    if mine is None:
        return False
    told = provenance(mine, result, material.get(MEASURED_DATE, ""))
    if movable(material) and state(material):
        told["changed"] = "with its traits changed by hand since"
    material[PROVENANCE] = told
    material.asset_mark()
    data = material.asset_data
    data.description = "; ".join(told.values())
    data.author = f"Patina {result['program']['version']}"
    for tag in ("Patina", "measured", name, Path(result["capture"]).name.split(".")[0]):
        data.tags.new(tag, skip_if_exists=True)
    return True


def provenance(material: dict[str, Any], result: dict[str, Any], date: str) -> dict[str, str]:
    """In words: scan, photos, date, version, errors."""
    photos = sum(count > 0 for count in material["samples"]["per_photo"].values())
    lights = [light["name"] for light in result["lights"]]
    told = {
        "scan": f"measured from {Path(result['capture']).name}",
        "photos": f"{photos} lit photos under {', '.join(lights)}",
        "date": f"on {date}" if date else "on a day that is not known",
        "version": f"by Patina {result['program']['version']}, {material['estimator']} method",
    }
    held = material.get("held_out")
    if held:
        told["error"] = f"predicts unseen photos to {100 * held['typical']:.1f} %"
    effects = [effect["cause"] for effect in result.get("effects", [])]
    if effects:
        told["effects"] = f"with {', '.join(effects)} taken into account"
    return told
