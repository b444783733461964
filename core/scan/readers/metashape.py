"""Metashape's and PhotoScan's cameras.xml (File > Export > Export Cameras, "Agisoft XML")."""

from __future__ import annotations

from pathlib import Path

from ...errors import InputError
from ..parsing.xml_file import XmlElement, line_of, read_xml
from ..reconstruction import Reconstruction
from .metashape_chunk import Chunk, read_chunk, with_notes
from .metashape_values import Source, flag


def read_metashape(path: Path, images: Path | None, chunk: str | None) -> Reconstruction:
    """Cameras of document versions 1.2 to 2.x. Raises InputError naming file and line.

    images is not needed. chunk: its label, where the file holds several.
    """
    root = read_xml(path)
    active = root.find("chunks")
    chosen = select_chunk(
        [_chunk(e, path) for e in chunk_elements(root, path)],
        chunk,
        None if active is None else active.get("active_id"),
        path,
    )
    return read_chunk(chosen)


def chunk_elements(root: XmlElement, file: Source) -> list[XmlElement]:
    """The <chunk> elements of a document. Raises InputError for a document of another kind."""
    if root.tag == "chunk":
        return [root]
    if root.tag != "document":
        kind = "a lens calibration" if root.tag == "calibration" else f"a <{root.tag[:40]}>"
        raise InputError(
            f"is {kind}, no <document> of Metashape's; expected what File > Export > Export "
            "Cameras writes as Agisoft XML",
            file=file,
            line=line_of(root),
        )
    return [*root.findall("chunk"), *root.findall("chunks/chunk")]  # type: ignore[list-item]


def _chunk(element: XmlElement, file: Source) -> Chunk:
    return Chunk(element.get("label") or "", element.get("id") or "", element, file)


def select_chunk(
    chunks: list[Chunk], wanted: str | None, active_id: str | None, file: Source
) -> Chunk:
    """The chunk of that label; without one the only one that has aligned cameras, else the active
    one. Raises InputError that lists them."""
    labels = ", ".join(repr(c.label or c.id) for c in chunks[:20]) or "none"
    if wanted is not None:
        found = [c for c in chunks if wanted in (c.label, c.id)]
        exact = [c for c in found if c.label == wanted]
        found = exact or found
        if not found:
            raise InputError(f"holds no chunk {wanted!r}; its chunks: {labels}", file=file)
        if len(found) > 1:
            raise InputError(f"holds {len(found)} chunks labelled {wanted!r}", file=file)
        return found[0]
    if not chunks:
        raise InputError("holds no chunk: no camera with a pose", file=file)
    posed = [c for c in chunks if c.has_poses]
    if len(posed) > 1:
        ticked = [c for c in posed if flag(c.element.get("enabled"), True)]
        posed = ticked or posed
    if len(posed) <= 1:
        chosen = (posed or chunks)[0]
        if len(chunks) > 1 and posed:
            return with_notes(chosen, f"of {len(chunks)} chunks {chosen.label!r} is read")
        return chosen
    active = [c for c in posed if active_id is not None and c.id == active_id]
    if len(active) == 1:
        return with_notes(
            active[0],
            f"of {len(posed)} chunks with aligned cameras the active one, {active[0].label!r}, is "
            "read",
        )
    raise InputError(
        f"holds {len(posed)} chunks with aligned cameras; name one as chunk: {labels}", file=file
    )
