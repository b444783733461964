"""Reader for Metashape's and PhotoScan's cameras.xml (File > Export > Export Cameras, "Agisoft
XML")."""

from __future__ import annotations

from pathlib import Path

from ...errors import InputError
from ..parsing.xml_file import XmlElement, line_of, read_xml
from ..reconstruction import Reconstruction
from .metashape_chunk import Chunk, read_chunk, with_notes
from .metashape_values import Source, flag


def read_metashape(path: Path, images: Path | None, chunk: str | None) -> Reconstruction:
    """Cameras of document versions 1.2 to 2.x. Raises InputError with file and line.

    images is not needed. chunk: label of the chunk, where the file holds several.
    """
    root = read_xml(path)
    active = root.find("chunks")
    selected = select_chunk(
        [_chunk(e, path) for e in chunk_elements(root, path)],
        chunk,
        None if active is None else active.get("active_id"),
        path,
    )
    return read_chunk(selected)


def chunk_elements(root: XmlElement, file: Source) -> list[XmlElement]:
    """The <chunk> elements of a document. Raises InputError for a document of another kind."""
    if root.tag == "chunk":
        return [root]
    if root.tag != "document":
        kind = "a lens calibration" if root.tag == "calibration" else f"a <{root.tag[:40]}>"
        raise InputError(
            f"is {kind}, not a Metashape <document>; expected a file from File > Export > Export "
            "Cameras in the format Agisoft XML",
            file=file,
            line=line_of(root),
        )
    return [*root.findall("chunk"), *root.findall("chunks/chunk")]  # type: ignore[list-item]


def _chunk(element: XmlElement, file: Source) -> Chunk:
    return Chunk(element.get("label") or "", element.get("id") or "", element, file)


def select_chunk(
    chunks: list[Chunk], wanted: str | None, active_id: str | None, file: Source
) -> Chunk:
    """The chunk with the label ``wanted``. Without a label: the only chunk with aligned cameras,
    else the active one. Raises InputError, which lists the chunks."""
    labels = ", ".join(repr(c.label or c.id) for c in chunks[:20]) or "none"
    if wanted is not None:
        found = [c for c in chunks if wanted in (c.label, c.id)]
        exact = [c for c in found if c.label == wanted]
        found = exact or found
        if not found:
            raise InputError(f"holds no chunk {wanted!r}; expected one of {labels}", file=file)
        if len(found) > 1:
            raise InputError(
                f"holds {len(found)} chunks with the label {wanted!r}; rename them in Metashape",
                file=file,
            )
        return found[0]
    if not chunks:
        raise InputError("holds no chunk, so no camera has a pose", file=file)
    posed = [c for c in chunks if c.has_poses]
    if len(posed) > 1:
        enabled = [c for c in posed if flag(c.element.get("enabled"), True)]
        posed = enabled or posed
    if len(posed) <= 1:
        selected = (posed or chunks)[0]
        if len(chunks) > 1 and posed:
            return with_notes(
                selected, f"The file holds {len(chunks)} chunks; {selected.label!r} was read."
            )
        return selected
    active = [c for c in posed if active_id is not None and c.id == active_id]
    if len(active) == 1:
        return with_notes(
            active[0],
            f"The file holds {len(posed)} chunks with aligned cameras; the active one, "
            f"{active[0].label!r}, was read.",
        )
    raise InputError(
        f"holds {len(posed)} chunks with aligned cameras; set [scan] chunk to one of {labels}",
        file=file,
    )
