"""Standard output and standard error without control characters.

Names of cameras, materials and files come from captures that strangers may have made. Escape codes
in them could change what a terminal shows, or what it copies and types.
"""

from __future__ import annotations

import contextlib
import re
import sys
from collections.abc import Iterator
from typing import Any, TextIO

CONTROL = re.compile(
    "[\x00-\x08\x0b-\x1f\x7f-\x9f"  # all but tab and line feed
    "\u200e\u200f\u202a-\u202e\u2066-\u2069"  # change the direction of text
    "\ud800-\udfff]"  # parts of file names that are not UTF-8
)


def visible(text: str) -> str:
    """The text with control characters as escape sequences of Python, such as \\x1b."""
    return CONTROL.sub(lambda found: found[0].encode("unicode_escape").decode("ascii"), text)


class PlainStream:
    """A text stream that writes control characters as escape sequences."""

    def __init__(self, stream: TextIO) -> None:
        self._stream = stream

    def write(self, text: str) -> int:
        """Write the text; returns its length."""
        self._stream.write(visible(text))
        return len(text)

    def __getattr__(self, name: str) -> Any:
        return getattr(self._stream, name)


@contextlib.contextmanager
def plain_output() -> Iterator[None]:
    """Write what is printed within the block through PlainStream."""
    with contextlib.ExitStack() as stack:
        if sys.stdout is not None:  # pythonw has none
            stack.enter_context(contextlib.redirect_stdout(PlainStream(sys.stdout)))  # type: ignore
        if sys.stderr is not None:
            stack.enter_context(contextlib.redirect_stderr(PlainStream(sys.stderr)))  # type: ignore
        yield
