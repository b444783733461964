"""Measured materials as assets, with tags and provenance."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import bpy

from ...core.counted import counted
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
    date = material.get(MEASURED_DATE) or own.get("date", "")
    origin = provenance(own, result, date)
    if own.get("changed") or (movable(material) and state(material)):
        origin["changed"] = "traits changed after the fit"
    material[PROVENANCE] = origin
    material.asset_mark()
    data = material.asset_data
    data.description = "; ".join(origin.values())
    data.author = f"Patina {_version(result)}"
    for tag in ("Patina", "measured", name, Path(result.get("capture", "")).name.split(".")[0]):
        if tag:
            data.tags.new(tag, skip_if_exists=True)
    return True


def _version(result: dict[str, Any]) -> str:
    return str(result.get("program", {}).get("version", "of an unknown version"))


def provenance(material: dict[str, Any], result: dict[str, Any], date: str) -> dict[str, str]:
    """Sentences on scan, photos, date, version and error, by key.

    material: an entry of ``result["materials"]``; result: the content of result.json; date: ISO
    8601, "" if unknown.
    """
    per_photo = material.get("samples", {}).get("per_photo", {})
    photos = sum(count > 0 for count in per_photo.values())
    lights = ", ".join(light["name"] for light in result.get("lights", [])) or "an unknown light"
    sentences = {
        "scan": f"measured from {Path(result.get('capture', '')).name or 'an unknown capture'}",
        "photos": f"{counted(photos, 'lit photo')} under {lights}",
        "date": f"on {date}" if date else "on an unknown date",
        "version": f"by Patina {_version(result)}, {material.get('estimator', 'paper')} method",
    }
    held = material.get("held_out")
    if held:
        sentences["error"] = f"median error of held-out photos {100 * held['typical']:.1f} %"
    effects = [effect["cause"].replace("_", " ") for effect in result.get("effects", [])]
    if effects:
        sentences["effects"] = f"with {', '.join(effects)} included in the model"
    return sentences
