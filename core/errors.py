"""Errors for users: each message says what was found, what was expected and what to do."""

from __future__ import annotations

import zlib
from pathlib import Path
from zipfile import BadZipFile

# raised by numpy for a file that is not an .npz or is damaged
UNREADABLE_NPZ = (
    OSError,
    KeyError,
    ValueError,
    EOFError,
    NotImplementedError,
    BadZipFile,
    zlib.error,
)


MAX_WORD = 320  # characters of a quoted name; paths that callers have shortened are not longer


class PatinaError(Exception):
    """An error that a user can resolve; its message is one line, shown without traceback."""

    def __init__(self, message: object = "") -> None:
        lines = str(message).splitlines()  # messages of other libraries have several
        super().__init__(" ".join(line.strip() for line in lines))


def system_error(error: OSError) -> str:
    """The message of an error of the system, such as a full disk, with the file that it names."""
    where = "" if error.filename is None else f"{error.filename}: "
    return f"{where}{error.strerror or error}"


class InputError(PatinaError):
    """Something is wrong in a file, key or option of the user.

    The message reads ``FILE:LINE: [key] what was found; what was expected``, as far as known.
    ``detail`` is the message without that prefix.
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
        # without the prefix, for callers that add their own
        self.detail = " ".join(_shortened(word) for word in message.split())
        where = "" if file is None else str(file) if line is None else f"{file}:{line}"
        head = ": ".join(part for part in (where, key and f"[{key}]") if part)
        super().__init__(" ".join(f"{head}: {self.detail}".split()) if head else self.detail)


class FitError(PatinaError):
    """The samples do not support a fit (too few, all masked, none lit …)."""


def _shortened(word: str) -> str:
    """Both ends of a long word, such as a name from a damaged file."""
    half = MAX_WORD // 2
    return word if len(word) <= MAX_WORD else f"{word[:half]}…{word[-half:]}"
