"""Read numbers and flags from Metashape's XML. Invalid values raise InputError with their line."""

from __future__ import annotations

import math
from pathlib import Path
from xml.etree.ElementTree import Element

import numpy as np
from numpy.typing import NDArray

from ...errors import InputError
from ..parsing.xml_file import line_of

Array = NDArray[np.float64]
Source = Path | str  # name of the file for messages


def numbers(element: Element, count: int, file: Source) -> Array:
    """(count,) the finite numbers in an element's text. Raises InputError."""
    parts = (element.text or "").split(None, count)
    try:
        values = [float(part) for part in parts]
    except ValueError:
        values = []
    if len(values) != count or not all(math.isfinite(value) for value in values):
        what = "a finite number" if count == 1 else f"{count} finite numbers"
        raise InputError(
            f"<{element.tag}> holds {_shown(element.text)}; expected {what}",
            file=file,
            line=line_of(element),
        )
    return np.array(values)


def number(parent: Element, name: str, file: Source, default: float = 0.0) -> float:
    """The number in a child element, ``default`` where it is missing: Metashape omits zeros. Raises
    InputError."""
    child = parent.find(name)
    if child is None or not (child.text or "").strip():
        return default
    return float(numbers(child, 1, file)[0])


def size(element: Element | None, file: Source) -> tuple[int, int] | None:
    """(width, height) of a <resolution>, None where there is none. Raises InputError."""
    if element is None:
        return None
    found = [(element.get(key) or "").strip() for key in ("width", "height")]
    if not all(text.isascii() and text.isdigit() and len(text) < 10 for text in found):
        raise InputError(
            f"a resolution of {_shown(found[0])} × {_shown(found[1])}; expected two numbers "
            "of pixels",
            file=file,
            line=line_of(element),
        )
    return int(found[0]), int(found[1])


def flag(text: str | None, default: bool) -> bool:
    """True or false of a text: true/false or 1/0."""
    if text is None:
        return default
    return text.strip().lower() not in ("false", "0", "no", "")


def properties(element: Element) -> dict[str, str]:
    """Name → value of the <property name= value=> children."""
    return {p.get("name", ""): p.get("value", "") for p in element.findall("property")}


def _shown(text: str | None) -> str:
    """The start of a text, for a message of one line."""
    short = " ".join((text or "").split())
    return repr(short if len(short) <= 40 else short[:37] + "…")
