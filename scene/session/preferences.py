"""What the artist prefers, as Blender's preferences keep it; the usual where nobody can prefer."""

from __future__ import annotations

from dataclasses import dataclass, fields

import bpy

from ...core.samples import Margins

PACKAGE = __package__.rpartition(".")[0]
NO_UNIT = "NONE"


@dataclass(frozen=True)
class Preferences:
    """merl_folder: of the artist's own MERL files, "" none. cache_folder: "" the usual one.
    cache_size: MB. silhouette, shadow, mask: pixels, cosine: as core.samples.Margins, for captures
    that do not say. unit: of the scans' lengths, NO_UNIT unknown."""

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
        """What is too close to trust."""
        return Margins(self.silhouette, self.shadow, self.mask, self.cosine)


def preferences() -> Preferences:
    """As they are now. A checkout is no add-on that Blender knows: the usual ones."""
    addon = bpy.context.preferences.addons.get(PACKAGE)
    told = addon.preferences if addon is not None else None
    if told is None:
        return Preferences()
    found = {field.name: getattr(told, field.name) for field in fields(Preferences)}
    found["cosine"] = round(found["cosine"], 6)  # Blender's numbers are of single precision
    return Preferences(**found)
