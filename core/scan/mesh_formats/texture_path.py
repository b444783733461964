"""Files that a mesh names: only those inside the mesh's own folder are followed."""

from __future__ import annotations

import re
from pathlib import Path

LONGEST_NAME = 1000
MOST_TEXTURES = 1000  # of one mesh; further ones are not looked for


def beside(mesh: Path, name: str) -> Path | None:
    """The file ``name`` of the folder of ``mesh`` or of one inside it; None for a name that leads
    out of it. An absolute name, as of the computer that wrote the mesh, is looked for by its last
    part. The file need not exist."""
    name = name.strip().strip('"').replace("\\", "/")
    if not name or len(name) > LONGEST_NAME or any(ord(c) < 32 for c in name):
        return None
    folder = mesh.parent.resolve()
    absolute = name.startswith("/") or re.match(r"[A-Za-z]:", name) is not None
    candidate = folder / (name.rsplit("/", 1)[-1] if absolute else name)
    try:
        found = candidate.resolve()  # through links and ..
        inside = found.is_relative_to(folder)
        if absolute and not found.is_file():
            return None
    except (OSError, ValueError, RuntimeError):
        return None
    return found if inside and found != folder else None
