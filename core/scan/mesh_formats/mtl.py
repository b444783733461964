"""Material libraries of OBJ files: only the names of the colour textures (map_Kd)."""

from __future__ import annotations

from pathlib import Path

from .texture_path import MOST_TEXTURES, beside

LARGEST_FILE = 16 << 20
MOST_LIBRARIES = 64
# options of map_Kd and how many words follow them at most
OPTIONS = {
    "-blendu": 1, "-blendv": 1, "-bm": 1, "-boost": 1, "-cc": 1, "-clamp": 1, "-imfchan": 1,
    "-mm": 2, "-o": 3, "-s": 3, "-t": 3, "-texres": 1, "-type": 1,
}  # fmt: skip


def read_textures(
    mesh: Path, libraries: list[str], names: tuple[str, ...]
) -> tuple[tuple[Path | None, ...], tuple[str, ...]]:
    """The colour texture of every material, () where none has one, and notes. A library that is
    missing, or lies outside the mesh's folder, changes nothing but the notes."""
    found: dict[str, str] = {}
    notes = []
    for library in dict.fromkeys(libraries[:MOST_LIBRARIES]):
        file = beside(mesh, library)
        if file is None:
            notes.append(f"its material library {_shown(library)} is not in its folder: not read")
            continue
        try:
            if not file.is_file() or file.stat().st_size > LARGEST_FILE:
                continue
            text = file.read_text(encoding="utf-8", errors="replace")
        except OSError:
            continue
        for name, texture in _textures(text):
            found.setdefault(name, texture)
    textures: list[Path | None] = []
    for name in names:
        named = found.get(name) if len(textures) < MOST_TEXTURES else None
        path = None if named is None else beside(mesh, named)
        if named is not None and path is None:
            notes.append(f"the texture {_shown(named)} is not in its folder: put it there")
        textures.append(path)
    return (tuple(textures) if any(textures) else ()), tuple(dict.fromkeys(notes[:10]))


def _textures(text: str) -> list[tuple[str, str]]:
    """(material, file name) of every map_Kd."""
    found, name = [], None
    for line in text.split("\n"):
        word, _, rest = line.strip().partition(" ")
        if word == "newmtl":
            name = rest.strip()
        elif word.lower() == "map_kd" and name is not None:
            texture = _without_options(rest.strip())
            if texture:
                found.append((name, texture))
    return found


def _without_options(rest: str) -> str:
    """The file name, which may hold blanks, behind options such as -s 1 1 1."""
    while rest.startswith("-"):
        option, _, rest = rest.partition(" ")
        for _ in range(OPTIONS.get(option, 0)):
            word, _, tail = rest.lstrip().partition(" ")
            if OPTIONS[option] == 3 and not _is_number(word):
                break  # -o, -s and -t take one to three numbers
            rest = tail
        rest = rest.lstrip()
    return rest


def _is_number(word: str) -> bool:
    try:
        float(word)
    except ValueError:
        return False
    return True


def _shown(name: str) -> str:
    return repr("".join(c if c.isprintable() else "?" for c in name[:80]))
