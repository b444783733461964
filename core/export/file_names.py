"""Names of exported files, and identifiers that are valid in every format."""

from __future__ import annotations

import re
import unicodedata

from ..errors import InputError

RESERVED = {"con", "prn", "aux", "nul", *(f"{p}{i}" for p in ("com", "lpt") for i in range(1, 10))}


def identifier(name: str) -> str:
    """The name of a material as letters, digits and underscores, without a leading digit: valid in
    XML, USD, MaterialX, Python and pbrt. Names reserved on Windows get a prefix."""
    plain = unicodedata.normalize("NFKD", name).encode("ascii", "ignore").decode()
    found = re.sub(r"\W+", "_", plain).strip("_") or "material"
    return f"m_{found}" if found[0].isdigit() or found.casefold() in RESERVED else found


def check_distinct(names: list[str]) -> None:
    """Raise InputError if two materials would be written to the same files."""
    seen: dict[str, str] = {}
    for name in names:
        key = identifier(name).casefold()
        if key in seen:
            raise InputError(
                f"{seen[key]!r} and {name!r} would both be written as {identifier(name)!r}; "
                "expected names that differ in letters and digits; export them one at a time",
                key="--material",
            )
        seen[key] = name
