"""Resolve file names inside a mesh file: only files in the mesh's own folder are used."""

from __future__ import annotations

import re
from pathlib import Path

MAX_NAME_LENGTH = 1000
MOST_TEXTURES = 1000  # of one mesh; further ones are ignored


def resolve_inside(mesh: Path, name: str) -> Path | None:
    """Path of the file ``name`` in the folder of ``mesh`` or below; None for a name that leads
    outside. An absolute path, as on the computer that wrote the mesh, is reduced to its last
    component. A relative file need not exist."""
    name = name.strip().strip('"').replace("\\", "/")
    if not name or len(name) > MAX_NAME_LENGTH or any(ord(c) < 32 for c in name):
        return None
    folder = mesh.parent.resolve()
    absolute = name.startswith("/") or re.match(r"[A-Za-z]:", name) is not None
    candidate = folder / (name.rsplit("/", 1)[-1] if absolute else name)
    try:
        found = candidate.resolve()  # resolves links and ..
        inside = found.is_relative_to(folder)
        if absolute and not found.is_file():
            return None
    except (OSError, ValueError, RuntimeError):
        return None
    return found if inside and found != folder else None
