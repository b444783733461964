"""The header of a PLY: elements, their counts and properties."""

from __future__ import annotations

import re
from dataclasses import dataclass, replace
from pathlib import Path

from ...errors import InputError
from .texture_path import MOST_TEXTURES

MAX_HEADER_BYTES = 1 << 16
NUMPY_TYPES = {
    "char": "i1", "uchar": "u1", "short": "i2", "ushort": "u2", "int": "i4", "uint": "u4",
    "float": "f4", "double": "f8", "int8": "i1", "uint8": "u1", "int16": "i2", "uint16": "u2",
    "int32": "i4", "uint32": "u4", "int64": "i8", "uint64": "u8", "float32": "f4",
    "float64": "f8",
}  # fmt: skip
ENDIANNESS = {"ascii": "<", "binary_little_endian": "<", "binary_big_endian": ">"}


@dataclass(frozen=True)
class Property:
    """type, count_type (of a list, else None): numpy types as stored; declared: the type in the
    header, without byte order."""

    name: str
    type: str
    count_type: str | None
    declared: str


@dataclass(frozen=True)
class Element:
    """One type of row, and its declared number of rows."""

    name: str
    count: int
    properties: tuple[Property, ...]

    def in_doubles(self) -> Element:
        """The same element with every value as a little-endian double."""
        return replace(
            self,
            properties=tuple(
                replace(p, type="<f8", count_type=p.count_type and "<f8") for p in self.properties
            ),
        )


@dataclass(frozen=True)
class Header:
    """is_text: whether the body is ascii; size: bytes of the header; lines: number of its lines."""

    is_text: bool
    elements: tuple[Element, ...]
    textures: tuple[str, ...]
    size: int
    lines: int


def read_header(data: bytes, path: Path) -> Header:
    """The header, with one element "vertex" and one "face". Raises InputError."""
    if not re.match(rb"ply[ \t]*[\r\n]", data):
        raise InputError("is not a PLY file (it does not begin with 'ply')", file=path)
    end = re.compile(rb"^end_header[ \t]*(\r\n|\n|\r|$)", re.MULTILINE)
    head = data[:MAX_HEADER_BYTES]
    # with old Macintosh line breaks (\r), a \n after the last \r belongs to the body
    if re.match(rb"ply[ \t]*\r(?!\n)", data):
        head = head.replace(b"\r", b"\n")
    found = end.search(head)
    if found is None:
        raise InputError("is truncated or not a PLY file: its header has no end", file=path)
    size = found.end()
    order: str | None = None
    is_text = False
    elements: list[Element] = []
    textures: list[str] = []
    lines = head[: found.start()].decode("latin-1").replace("\r", "").split("\n")
    for number, line in enumerate(lines, start=1):
        words = line.split()
        match words:
            case ["format", kind, _]:
                if kind not in ENDIANNESS:
                    raise InputError(f"unknown PLY format {kind[:40]!r}", file=path, line=number)
                order, is_text = ENDIANNESS[kind], kind == "ascii"
            case ["element", name, count]:
                if not re.fullmatch(r"\d{1,18}", count):
                    raise InputError(
                        f"found {count[:40]!r}; expected a count", file=path, line=number
                    )
                elements.append(Element(name, int(count), ()))
            case ["property", *rest] if elements and order is not None:
                added = _property(rest, order)
                last = elements[-1]
                if added is None or any(p.name == added.name for p in last.properties):
                    raise InputError(
                        f"has an invalid property: {line[:60]!r}", file=path, line=number
                    )
                elements[-1] = replace(last, properties=(*last.properties, added))
            case ["comment", "TextureFile", *rest] if rest and len(textures) < MOST_TEXTURES:
                textures.append(line.split("TextureFile", 1)[1].strip())
            case ["comment" | "obj_info" | "ply", *_] | []:
                pass
            case _:
                raise InputError(
                    f"has an invalid header line: {line[:60]!r}", file=path, line=number
                )
    if order is None:
        raise InputError("its header does not declare the format", file=path)
    _check(elements, path)
    return Header(is_text, tuple(elements), tuple(textures), size, len(lines))


def _property(words: list[str], order: str) -> Property | None:
    match words:
        case ["list", count, kind, name] if (
            NUMPY_TYPES.get(count, "f")[0] != "f" and kind in NUMPY_TYPES
        ):
            return Property(
                name, order + NUMPY_TYPES[kind], order + NUMPY_TYPES[count], NUMPY_TYPES[kind]
            )
        case [kind, name] if kind in NUMPY_TYPES:
            return Property(name, order + NUMPY_TYPES[kind], None, NUMPY_TYPES[kind])
    return None


def _check(elements: list[Element], path: Path) -> None:
    names = [element.name for element in elements]
    duplicate = next((name for name in names if names.count(name) > 1), None)
    if duplicate is not None:
        raise InputError(f"element {duplicate[:40]!r} is declared twice", file=path)
    if "tristrips" in names:
        raise InputError(
            "holds triangle strips, which are not supported; export triangles", file=path
        )
    if "vertex" not in names:
        raise InputError("has no vertices", file=path)
    face = next((element for element in elements if element.name == "face"), None)
    lists = [] if face is None else [p.name for p in face.properties if p.count_type]
    if face is None or not face.count:
        raise InputError(
            "the mesh has no faces (is it a point cloud?); export the surface", file=path
        )
    if not {"vertex_indices", "vertex_index"} & set(lists):
        raise InputError("its faces lack the list vertex_indices", file=path)
