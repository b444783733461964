"""Reader for the material libraries of OBJ files: only the colour textures (map_Kd)."""

from __future__ import annotations

from pathlib import Path

from .texture_path import MOST_TEXTURES, resolve_inside

MAX_FILE_BYTES = 16 << 20
MAX_LIBRARIES = 64
# option of map_Kd → maximum number of words after it
OPTION_WORDS = {
    "-blendu": 1, "-blendv": 1, "-bm": 1, "-boost": 1, "-cc": 1, "-clamp": 1, "-imfchan": 1,
    "-mm": 2, "-o": 3, "-s": 3, "-t": 3, "-texres": 1, "-type": 1,
}  # fmt: skip


def read_textures(
    mesh: Path, libraries: list[str], names: tuple[str, ...]
) -> tuple[tuple[Path | None, ...], tuple[str, ...]]:
    """(colour texture of every material, () where none has one; notes). A library that is missing,
    or outside the mesh's folder, only adds a note."""
    found: dict[str, str] = {}
    notes = []
    for library in dict.fromkeys(libraries[:MAX_LIBRARIES]):
        file = resolve_inside(mesh, library)
        if file is None:
            notes.append(
                f"The material library {_shown(library)} is not in the mesh's folder; it was "
                "not read."
            )
            continue
        try:
            if not file.is_file() or file.stat().st_size > MAX_FILE_BYTES:
                continue
            text = file.read_text(encoding="utf-8", errors="replace")
        except OSError:
            continue
        for name, texture in _textures(text):
            found.setdefault(name, texture)
    textures: list[Path | None] = []
    for name in names:
        named = found.get(name) if len(textures) < MOST_TEXTURES else None
        path = None if named is None else resolve_inside(mesh, named)
        if named is not None and path is None:
            notes.append(f"The texture {_shown(named)} is not in the mesh's folder. Copy it there.")
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
    """The file name, which may contain spaces, after options such as -s 1 1 1."""
    while rest.startswith("-"):
        option, _, rest = rest.partition(" ")
        for _ in range(OPTION_WORDS.get(option, 0)):
            word, _, tail = rest.lstrip().partition(" ")
            if OPTION_WORDS[option] == 3 and not _is_number(word):
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
