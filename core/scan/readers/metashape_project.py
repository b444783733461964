"""Metashape's and PhotoScan's projects: .psx with its folder, .psz in one file.

A .psx is ``<document path="{projectname}.files/project.zip"/>``; the folder beside it holds
project.zip (the list of chunks), N/chunk.zip (sensors, cameras, transforms) and N/0/frame.zip (the
photos' paths), each with a doc.xml. A .psz is one zip whose doc.xml holds all of it, or says where
in the zip the rest lies. Meshes stay where they are: a project keeps them in the chunk's frame, and
Metashape exports them.
"""

from __future__ import annotations

import io
from collections.abc import Callable
from contextlib import ExitStack
from dataclasses import replace
from pathlib import Path, PurePosixPath, PureWindowsPath
from xml.etree.ElementTree import Element

from ...errors import InputError
from ..parsing.xml_file import LARGEST, XmlElement, line_of, read_xml
from ..reconstruction import Reconstruction
from .metashape import chunk_elements, select_chunk
from .metashape_chunk import Chunk, read_chunk, with_notes
from .metashape_zip import document, document_in, member, open_zip

# path inside the project → its XML; None: there is no such file
Opener = Callable[[str], bytes | None]
LARGEST_TOGETHER = 2 * LARGEST  # bytes: all documents that are read of a project


class Documents:
    """The XML documents of a project, read one by one and counted."""

    def __init__(self, path: Path, opener: Opener) -> None:
        self.path = path
        self._opener = opener
        self._left = LARGEST_TOGETHER

    def read(self, place: str) -> tuple[XmlElement, str] | None:
        """(root, what messages call it), None where there is no such file. Raises InputError."""
        data = self._opener(place)
        if data is None:
            return None
        self._left -= len(data)
        if self._left < 0:
            raise InputError("is too large for a project of Metashape's", file=self.path)
        name = member_name(self.path, place)
        return read_xml(data, name), name


def member_name(path: Path, place: str) -> str:
    """What messages call a file inside a project."""
    return f"{path} ({place})"


def read_metashape_project(path: Path, images: Path | None, chunk: str | None) -> Reconstruction:
    """Cameras of a project (document versions 1.2 to 2.x). Raises InputError.

    images is not needed; photos get the paths the project says. chunk: its label, where the project
    holds several.
    """
    with ExitStack() as stack:
        if path.suffix.lower() == ".psx":
            opener, start = _folder(path)
        else:
            opener, start = _archive(path, stack), "doc.xml"
        documents = Documents(path, opener)
        found = documents.read(start)
        if found is None:
            raise InputError("holds no doc.xml; expected a project of Metashape's", file=path)
        root, name = found
        base = PurePosixPath(start).parent
        chunks, folders = [], {}
        for element in chunk_elements(root, name):
            opened, folder = _opened_chunk(element, base, documents, name)
            chunks.append(opened)
            folders[id(opened.element)] = folder
        listed = root.find("chunks")
        active = None if listed is None else listed.get("active_id")
        chosen = select_chunk(chunks, chunk, active, path)
        chosen = _with_photos(chosen, folders[id(chosen.element)], documents)
    return read_chunk(chosen)


def _folder(path: Path) -> tuple[Opener, str]:
    """What opens the zips in a .psx's folder, and where to start."""
    root = read_xml(path)
    written = root.get("path")
    if root.tag != "document" or not written:
        raise InputError(
            "is no project of Metashape's; expected <document path=\"{projectname}.files/"
            'project.zip">',
            file=path,
            line=line_of(root),
        )
    start = _inside(written.replace("{projectname}", path.stem), PurePosixPath(), path, root)

    def opener(place: str) -> bytes | None:
        file = path.parent / place
        try:
            there = file.is_file()
        except OSError:  # a name that no file can have
            there = False
        if not there:
            if place == start:
                raise InputError(
                    f"its folder {PurePosixPath(start).parent.name!r} with {file.name!r} is not "
                    "beside it; copy both",
                    file=path,
                )
            return None
        return document_in(file, member_name(path, place))

    return opener, start


def _archive(path: Path, stack: ExitStack) -> Opener:
    """What opens the documents inside a .psz."""
    try:
        file = stack.enter_context(path.open("rb"))
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
    """A path below ``base``, as the project writes it. Raises InputError where it leads out."""
    parts = PurePosixPath(place.replace("\\", "/")).parts
    outside = place.startswith(("/", "\\")) or PureWindowsPath(place).drive or ".." in parts
    if outside or not parts or "\0" in place:
        raise InputError(
            f"its path {place[:80]!r} leads out of the project's folder; expected one below it",
            file=str(file),
            line=line_of(element),
        )
    return str(base.joinpath(*parts))


def _opened_chunk(
    element: XmlElement, base: PurePosixPath, documents: Documents, name: str
) -> tuple[Chunk, PurePosixPath]:
    """(a chunk, where its files lie): itself, or the document it points to."""
    where = element.get("path")
    identity = element.get("id") or ""
    if where is None:
        return Chunk(element.get("label") or "", identity, element, name), base
    place = _inside(where, base, name, element)
    found = documents.read(place)
    if found is None:
        raise InputError(
            f"its chunk {identity!r} is missing: there is no {place!r}",
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
    """The chunk with the paths of its photos, which its first frame says."""
    frames = chunk.element.findall("frames/frame")
    notes = []
    if len(frames) > 1:
        notes.append(f"of {len(frames)} frames of the chunk the first is read")
    frame: Element | None = frames[0] if frames else None
    if frame is not None and frame.get("path"):
        place = _inside(frame.get("path", ""), folder, chunk.file, frame)
        found = documents.read(place)
        if found is None:
            notes.append(f"the photos' paths are not known: there is no {place!r}")
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
            "the project's model is not read from it: export it from Metashape (File > Export > "
            "Export Model)"
        )
    return with_notes(replace(chunk, photos=photos), *notes)


def _photo_path(written: str, folder: PurePosixPath, path: Path) -> str:
    """The photo's path; one that is relative starts where its frame.zip lies."""
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
