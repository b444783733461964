"""XML of a reconstruction tool, opened without believing it."""

from __future__ import annotations

from pathlib import Path
from xml.etree.ElementTree import Element, ParseError, TreeBuilder

from defusedxml import DefusedXmlException
from defusedxml.ElementTree import DefusedXMLParser

from ...errors import InputError

LARGEST = 1 << 27  # bytes; a hundred thousand cameras of Metashape are 50 MB
MOST_ELEMENTS = 1_000_000  # the same are 600,000
DEEPEST = 100  # elements inside each other; no tool writes more than 12


class XmlElement(Element):
    """An element that knows the line it starts on, for the message that names it."""

    __slots__ = ("line",)
    line: int | None


class _Beyond(Exception):
    """More than any tool writes."""


class _Tree(TreeBuilder):
    """Builds the tree while it stays within bounds."""

    def __init__(self) -> None:
        super().__init__(element_factory=XmlElement)
        self.parser: DefusedXMLParser | None = None
        self.depth = self.count = 0

    def start(self, tag: str, attrs: dict[str, str]) -> Element:
        self.depth += 1
        self.count += 1
        if self.depth > DEEPEST:
            raise _Beyond(f"its elements are nested more than {DEEPEST} deep")
        if self.count > MOST_ELEMENTS:
            raise _Beyond(f"it holds more than {MOST_ELEMENTS:,} elements")
        element = super().start(tag, attrs)
        assert isinstance(element, XmlElement) and self.parser is not None
        element.line = self.parser.parser.CurrentLineNumber
        return element

    def end(self, tag: str) -> Element:
        self.depth -= 1
        return super().end(tag)


def read_xml(source: Path | bytes, file: Path | str | None = None) -> XmlElement:
    """The root of the document in a file, or in bytes that came from one (``file`` names it).

    Each element has a ``line``; so has the InputError raised for what is no XML, is too large or
    too deep, or carries a document type (with it come entities: bombs, and files from elsewhere).
    """
    name = file if file is not None or isinstance(source, bytes) else source
    data = source if isinstance(source, bytes) else _bytes_of(source)
    if len(data) > LARGEST:
        raise InputError(
            f"is too large for a file of cameras (more than {LARGEST >> 20} MB)", file=name
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
    except _Beyond as error:
        raise InputError(
            f"is not an XML that any tool writes: {error}", file=name, line=_line(parser)
        ) from error
    except DefusedXmlException as error:
        raise InputError(
            "declares a document type (<!DOCTYPE …>), which no tool of reconstruction writes; "
            "take it out if you trust the file",
            file=name,
            line=_line(parser),
        ) from error
    except (LookupError, ValueError) as error:  # an encoding the parser does not know
        raise InputError(
            f"is in an encoding that is not read ({error}); expected UTF-8", file=name
        ) from error
    assert isinstance(root, XmlElement)
    return root


def line_of(element: Element | None) -> int | None:
    """The line an element starts on, where known."""
    return getattr(element, "line", None)


def _bytes_of(path: Path) -> bytes:
    try:
        with path.open("rb") as file:
            return file.read(LARGEST + 1)  # never more: the file may be a device, or grow
    except OSError as error:
        raise InputError(f"cannot be read ({error.strerror})", file=path) from error


def _line(parser: DefusedXMLParser) -> int:
    return int(parser.parser.CurrentLineNumber)
