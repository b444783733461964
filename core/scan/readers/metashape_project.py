"""Reader for Metashape's and PhotoScan's projects: .psx with its folder, .psz in one file.

A .psx is ``<document path="{projectname}.files/project.zip"/>``. Its folder holds project.zip (the
list of chunks), N/chunk.zip (sensors, cameras, transforms) and N/0/frame.zip (the photos' paths),
each with a doc.xml. A .psz is one zip whose doc.xml holds all of it, or refers to other files in
the zip. The project's mesh is not read, because it is in the chunk's frame; export it from
Metashape.
"""

from __future__ import annotations

import io
from collections.abc import Callable
from contextlib import ExitStack
from dataclasses import replace
from pathlib import Path, PurePosixPath, PureWindowsPath
from xml.etree.ElementTree import Element

from ...errors import InputError
from ...files import open_regular
from ..parsing.xml_file import MAX_XML_BYTES, XmlElement, line_of, read_xml
from ..reconstruction import Reconstruction
from .metashape import chunk_elements, select_chunk
from .metashape_chunk import Chunk, read_chunk, with_notes
from .metashape_zip import document, document_in, member, open_zip

# path inside the project → its XML, or None where the file does not exist
Opener = Callable[[str], bytes | None]
MAX_TOTAL_BYTES = 2 * MAX_XML_BYTES  # bytes of all documents that are read from a project


class Documents:
    """The XML documents of a project. Their total size is limited to MAX_TOTAL_BYTES."""

    def __init__(self, path: Path, opener: Opener) -> None:
        self.path = path
        self._opener = opener
        self._left = MAX_TOTAL_BYTES

    def read(self, place: str) -> tuple[XmlElement, str] | None:
        """(root, name for messages); None where the file does not exist. Raises InputError."""
        data = self._opener(place)
        if data is None:
            return None
        self._left -= len(data)
        if self._left < 0:
            raise InputError("is too large for a Metashape project", file=self.path)
        name = member_name(self.path, place)
        return read_xml(data, name), name


def member_name(path: Path, place: str) -> str:
    """Name for messages of a file inside a project."""
    return f"{path} ({place})"


def read_metashape_project(path: Path, images: Path | None, chunk: str | None) -> Reconstruction:
    """Cameras of a project (document versions 1.2 to 2.x). Raises InputError.

    images is not needed; photos have the paths that the project holds. chunk: label of the chunk,
    where the project holds several.
    """
    with ExitStack() as stack:
        if path.suffix.lower() == ".psx":
            opener, start = _folder(path)
        else:
            opener, start = _archive(path, stack), "doc.xml"
        documents = Documents(path, opener)
        found = documents.read(start)
        if found is None:
            raise InputError("holds no doc.xml; expected a Metashape project", file=path)
        root, name = found
        base = PurePosixPath(start).parent
        chunks, folders = [], {}
        for element in chunk_elements(root, name):
            opened, folder = _opened_chunk(element, base, documents, name)
            chunks.append(opened)
            folders[id(opened.element)] = folder
        listed = root.find("chunks")
        active = None if listed is None else listed.get("active_id")
        selected = select_chunk(chunks, chunk, active, path)
        selected = _with_photos(selected, folders[id(selected.element)], documents)
    return read_chunk(selected)


def _folder(path: Path) -> tuple[Opener, str]:
    """(function that opens the zips in a .psx's folder, path of the first document)."""
    root = read_xml(path)
    written = root.get("path")
    if root.tag != "document" or not written:
        raise InputError(
            'is not a Metashape project; expected <document path="{projectname}.files/'
            'project.zip">',
            file=path,
            line=line_of(root),
        )
    start = _inside(written.replace("{projectname}", path.stem), PurePosixPath(), path, root)

    def opener(place: str) -> bytes | None:
        file = path.parent / place
        try:
            exists = file.is_file()
        except OSError:  # a name that no file can have
            exists = False
        if not exists:
            if place == start:
                raise InputError(
                    f"its folder {PurePosixPath(start).parent.name!r} with {file.name!r} is "
                    "missing; copy the folder to the same place as the file",
                    file=path,
                )
            return None
        return document_in(file, member_name(path, place))

    return opener, start


def _archive(path: Path, stack: ExitStack) -> Opener:
    """Function that opens the documents inside a .psz."""
    try:
        file = stack.enter_context(open_regular(path))
    except OSError as error:
        raise InputError(f"cannot be read ({error.strerror})", file=path) from error
    archive = stack.enter_context(open_zip(file, path))

    def opener(place: str) -> bytes | None:
        name = member_name(path, place)
        data = member(archive, place, name)
        if data is None or not place.lower().endswith(".zip"):
            return data
        with open_zip(io.BytesIO(data), name) as inner:
            return document(inner, name)

    return opener


def _inside(place: str, base: PurePosixPath, file: object, element: Element) -> str:
    """A path below ``base``, as written in the project. Raises InputError where it leads
    outside."""
    parts = PurePosixPath(place.replace("\\", "/")).parts
    outside = place.startswith(("/", "\\")) or PureWindowsPath(place).drive or ".." in parts
    if outside or not parts or "\0" in place:
        raise InputError(
            f"its path {place[:80]!r} leads outside the project's folder; expected a path "
            "inside it",
            file=str(file),
            line=line_of(element),
        )
    return str(base.joinpath(*parts))


def _opened_chunk(
    element: XmlElement, base: PurePosixPath, documents: Documents, name: str
) -> tuple[Chunk, PurePosixPath]:
    """(a chunk, folder of its files): the element itself, or the document it refers to."""
    where = element.get("path")
    identity = element.get("id") or ""
    if where is None:
        return Chunk(element.get("label") or "", identity, element, name), base
    place = _inside(where, base, name, element)
    found = documents.read(place)
    if found is None:
        raise InputError(
            f"its chunk {identity!r} is missing; expected the file {place!r}",
            file=name,
            line=line_of(element),
        )
    root, inner = found
    roots = chunk_elements(root, inner)
    if len(roots) != 1:
        raise InputError(f"holds {len(roots)} chunks; expected one", file=inner)
    label = roots[0].get("label") or element.get("label") or ""
    return Chunk(label, identity, roots[0], inner), PurePosixPath(place).parent


def _with_photos(chunk: Chunk, folder: PurePosixPath, documents: Documents) -> Chunk:
    """The chunk with the paths of its photos from its first frame."""
    frames = chunk.element.findall("frames/frame")
    notes = []
    if len(frames) > 1:
        notes.append(f"The chunk has {len(frames)} frames; the first was read.")
    frame: Element | None = frames[0] if frames else None
    if frame is not None and frame.get("path"):
        place = _inside(frame.get("path", ""), folder, chunk.file, frame)
        found = documents.read(place)
        if found is None:
            notes.append(f"The paths of the photos are unknown: {place!r} is missing.")
        frame = None if found is None else found[0]
        folder = PurePosixPath(place).parent
    photos = {}
    for camera in () if frame is None else frame.iterfind("cameras/camera"):
        photo = camera.find("photo")
        written = None if photo is None else photo.get("path")
        if written:
            photos[camera.get("camera_id", "")] = _photo_path(written, folder, documents.path)
    if any(e.find(".//model") is not None for e in (chunk.element, frame) if e is not None):
        notes.append(
            "The mesh inside the project was not read. Export it from Metashape (File > Export > "
            "Export Model)."
        )
    return with_notes(replace(chunk, photos=photos), *notes)


def _photo_path(written: str, folder: PurePosixPath, path: Path) -> str:
    """Path of the photo; a relative path starts at the folder of its frame.zip."""
    written = written.removeprefix("file:///") if ":" in written[8:11] else written
    if written.startswith(("/", "\\")) or PureWindowsPath(written).drive or "://" in written:
        return written
    parts: list[str] = list(folder.parts)
    for part in PurePosixPath(written.replace("\\", "/")).parts:
        if part == ".." and parts and parts[-1] != "..":
            parts.pop()
        else:
            parts.append(part)
    return str(path.parent.joinpath(*parts))
