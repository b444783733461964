"""Errors of our own: each says what was found, what was expected and what to do."""

from __future__ import annotations

import zlib
from pathlib import Path
from zipfile import BadZipFile

# what numpy raises for a file that is no .npz, or a damaged one
UNREADABLE_NPZ = (
    OSError,
    KeyError,
    ValueError,
    EOFError,
    NotImplementedError,
    BadZipFile,
    zlib.error,
)


class PatinaError(Exception):
    """Anything Patina refuses to do, with a message a user can act on (one line, no traceback)."""


class InputError(PatinaError):
    """A file or key of the user's is wrong.

    The message reads ``FILE:LINE: [key] what was found; what was expected``, as far as known.
    """

    def __init__(
        self,
        message: str,
        *,
        file: Path | str | None = None,
        key: str | None = None,
        line: int | None = None,
    ) -> None:
        self.file, self.key, self.line = file, key, line
        self.said = " ".join(message.split())  # without where, for whoever knows better where
        where = "" if file is None else str(file) if line is None else f"{file}:{line}"
        head = ": ".join(part for part in (where, key and f"[{key}]") if part)
        super().__init__(" ".join(f"{head}: {message}".split()) if head else message)


class FitError(PatinaError):
    """The samples cannot support a fit (too few, all masked, nothing lit …)."""
