"""Where in a TOML text its keys and values stand, so that one can be changed and all else kept."""

from __future__ import annotations

import tomllib
from collections.abc import Iterator
from dataclasses import dataclass

Path = tuple[str | int, ...]


@dataclass(frozen=True)
class Statement:
    """One ``key = value`` or one [header]; places are characters of the text.

    path: of the value or the table, members of arrays of tables by their place. start, end: its
    lines, with the last line's break. value: (start, end) of what is right of the =, without a
    comment; None of a header.
    """

    path: Path
    start: int
    end: int
    value: tuple[int, int] | None = None


def statements(text: str) -> Iterator[Statement]:
    """All statements of a valid TOML text (https://toml.io/en/v1.0.0), in order. What is not valid
    gives statements that mean nothing, never an endless loop."""
    counts: dict[Path, int] = {}
    table: Path = ()
    at = 1 if text.startswith("\ufeff") else 0
    while at < len(text):
        start, at = at, _blank(text, at)
        if at == len(text):
            return
        if text[at] in "#\r\n":
            at = _line_end(text, at)
            continue
        if text[at] == "[":
            twice = text.startswith("[[", at)
            closing = _find(text, at + 1 + twice, "]")
            table = _table(_key(text[at + 1 + twice : closing]), twice, counts)
            at = _line_end(text, closing)
            yield Statement(table, start, at)
            continue
        equals = _find(text, at, "=")
        path = (*table, *_key(text[at:equals]))
        begin = _blank(text, equals + 1)
        end = _value_end(text, begin)
        at = _line_end(text, end)
        yield Statement(path, start, at, (begin, end))


def _table(key: Path, twice: bool, counts: dict[Path, int]) -> Path:
    """The path of a header: each array of tables on the way is at its last member."""
    path: Path = ()
    for place, part in enumerate(key):
        path = (*path, part)
        if twice and place == len(key) - 1:
            counts[path] = counts.get(path, -1) + 1
        if path in counts:
            path = (*path, counts[path])
    return path


def _key(text: str) -> Path:
    """The parts of a dotted key."""
    try:
        value = tomllib.loads(f"{text.strip()} = 0")
    except tomllib.TOMLDecodeError:
        return ()
    parts: list[str] = []
    while isinstance(value, dict) and value:
        part, value = next(iter(value.items()))
        parts.append(part)
    return tuple(parts)


def _blank(text: str, at: int) -> int:
    while at < len(text) and text[at] in " \t":
        at += 1
    return at


def _line_end(text: str, at: int) -> int:
    """The place after the next line break."""
    found = text.find("\n", at)
    return len(text) if found < 0 else found + 1


def _find(text: str, at: int, what: str) -> int:
    """The next ``what`` outside of quotes."""
    while at < len(text) and text[at] != what:
        at = _after_string(text, at) if text[at] in "\"'" else at + 1
    return at


def _value_end(text: str, at: int) -> int:
    """The place after a value."""
    depth, last = 0, at
    while at < len(text):
        letter = text[at]
        if depth == 0 and letter in "#\r\n":
            return last
        if letter == "#":
            at = _line_end(text, at)
            continue
        if letter in "\"'":
            at = _after_string(text, at)
        else:
            depth += (letter in "[{") - (letter in "]}")
            at += 1
        if letter not in " \t\r\n":
            last = at
    return last


def _after_string(text: str, at: int) -> int:
    """The place after the string that begins here."""
    quote = text[at]
    fence = quote * 3 if text.startswith(quote * 3, at) else quote
    at += len(fence)
    while at < len(text):
        if quote == '"' and text[at] == "\\":
            at += 2
        elif text.startswith(fence, at):
            at += len(fence)
            for _ in range(2 * (len(fence) == 3)):  # two quotes of its own may end it
                at += text.startswith(quote, at)
            return at
        elif len(fence) == 1 and text[at] == "\n":
            return at
        else:
            at += 1
    return len(text)
