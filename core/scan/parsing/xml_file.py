"""Open a reconstruction tool's XML, within limits on its size and depth and without entities."""

from __future__ import annotations

from pathlib import Path
from xml.etree.ElementTree import Element, ParseError, TreeBuilder

from defusedxml import DefusedXmlException
from defusedxml.ElementTree import DefusedXMLParser

from ...errors import InputError
from ...files import read_regular

MAX_XML_BYTES = 1 << 27  # bytes; 100,000 Metashape cameras take 50 MB
MAX_ELEMENTS = 1_000_000  # 100,000 Metashape cameras take 600,000
MAX_DEPTH = 100  # nested elements; no tool writes more than 12


class XmlElement(Element):
    """An element with the line it starts on, for messages."""

    __slots__ = ("line",)
    line: int | None


class _LimitExceeded(Exception):
    """The document exceeds MAX_ELEMENTS or MAX_DEPTH."""


class _Tree(TreeBuilder):
    """A tree builder that enforces the limits."""

    def __init__(self) -> None:
        super().__init__(element_factory=XmlElement)
        self.parser: DefusedXMLParser | None = None
        self.depth = self.count = 0

    def start(self, tag: str, attrs: dict[str, str]) -> Element:
        self.depth += 1
        self.count += 1
        if self.depth > MAX_DEPTH:
            raise _LimitExceeded(f"its elements are nested more than {MAX_DEPTH} deep")
        if self.count > MAX_ELEMENTS:
            raise _LimitExceeded(f"it holds more than {MAX_ELEMENTS:,} elements")
        element = super().start(tag, attrs)
        assert isinstance(element, XmlElement) and self.parser is not None
        element.line = self.parser.parser.CurrentLineNumber
        return element

    def end(self, tag: str) -> Element:
        self.depth -= 1
        return super().end(tag)


def read_xml(source: Path | bytes, file: Path | str | None = None) -> XmlElement:
    """Root of the document in a file, or in bytes that were read from one (``file`` is its name for
    messages).

    Each element has a ``line``, as has the InputError. It is raised for invalid XML, for documents
    that are too large or too deep, and for a document type, because that can declare entities
    (expansion bombs, external files).
    """
    name = file if file is not None or isinstance(source, bytes) else source
    data = source if isinstance(source, bytes) else _bytes_of(source)
    if len(data) > MAX_XML_BYTES:
        raise InputError(
            f"is too large for a file of cameras (more than {MAX_XML_BYTES >> 20} MB)", file=name
        )
    tree = _Tree()
    parser = DefusedXMLParser(target=tree, forbid_dtd=True)
    tree.parser = parser
    try:
        parser.feed(data)
        root = parser.close()
    except ParseError as error:
        raise InputError(
            f"is not valid XML ({str(error).partition(':')[0]})", file=name, line=error.position[0]
        ) from error
    except _LimitExceeded as error:
        raise InputError(
            f"exceeds the limits for a file of cameras: {error}", file=name, line=_line(parser)
        ) from error
    except DefusedXmlException as error:
        raise InputError(
            "declares a document type (<!DOCTYPE …>), which no reconstruction tool writes; "
            "remove it if you trust the file",
            file=name,
            line=_line(parser),
        ) from error
    except (LookupError, ValueError) as error:  # an encoding unknown to the parser
        raise InputError(
            f"has an unsupported encoding ({error}); expected UTF-8", file=name
        ) from error
    assert isinstance(root, XmlElement)
    return root


def line_of(element: Element | None) -> int | None:
    """The line an element starts on, where known."""
    return getattr(element, "line", None)


def _bytes_of(path: Path) -> bytes:
    try:
        return read_regular(path, MAX_XML_BYTES + 1)  # bounded: the file may grow
    except OSError as error:
        raise InputError(f"cannot be read ({error.strerror})", file=path) from error


def _line(parser: DefusedXMLParser) -> int:
    return int(parser.parser.CurrentLineNumber)
