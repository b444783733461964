"""The extension's preferences as a plain dataclass, with defaults if there are none."""

from __future__ import annotations

from dataclasses import dataclass, fields

import bpy

from ...core.samples import Margins

PACKAGE = __package__.rsplit(".", 2)[0]
NO_UNIT = "NONE"


@dataclass(frozen=True)
class Preferences:
    """The preferences.

    merl_folder: of the user's own MERL files, "" for none. cache_folder: "" for the default one.
    cache_size: MB. silhouette, shadow, mask (pixels) and cosine: values of core.samples.Margins for
    captures that do not set them. unit: length of a scan unit, NO_UNIT if unknown.
    """

    merl_folder: str = ""
    cache_folder: str = ""
    cache_size: int = 4096
    silhouette: int = Margins().silhouette
    shadow: int = Margins().shadow
    mask: int = Margins().mask
    cosine: float = Margins().cosine
    unit: str = NO_UNIT

    @property
    def margins(self) -> Margins:
        """The margins for captures that do not set them."""
        return Margins(self.silhouette, self.shadow, self.mask, self.cosine)


def preferences() -> Preferences:
    """The present preferences; the defaults if the extension is run from a checkout, which Blender
    does not know as an add-on."""
    addon = bpy.context.preferences.addons.get(PACKAGE)
    stored = addon.preferences if addon is not None else None
    if stored is None:
        return Preferences()
    found = {field.name: getattr(stored, field.name) for field in fields(Preferences)}
    found["cosine"] = round(found["cosine"], 6)  # Blender stores single precision
    return Preferences(**found)
