"""Names of what is written, and identifiers that every format takes."""

from __future__ import annotations

import re
import unicodedata

from ..errors import InputError

RESERVED = {"con", "prn", "aux", "nul", *(f"{p}{i}" for p in ("com", "lpt") for i in range(1, 10))}


def identifier(name: str) -> str:
    """A material's name as letters, digits and underscores, not beginning with a digit: valid in
    XML, USD, MaterialX, Python and pbrt."""
    plain = unicodedata.normalize("NFKD", name).encode("ascii", "ignore").decode()
    found = re.sub(r"\W+", "_", plain).strip("_") or "material"
    return f"m_{found}" if found[0].isdigit() or found.casefold() in RESERVED else found


def check_distinct(names: list[str]) -> None:
    """Raises InputError where two materials would write the same files."""
    seen: dict[str, str] = {}
    for name in names:
        key = identifier(name).casefold()
        if key in seen:
            raise InputError(
                f"{seen[key]!r} and {name!r} would both be written as {identifier(name)!r}: "
                "export them one at a time",
                key="--material",
            )
        seen[key] = name
