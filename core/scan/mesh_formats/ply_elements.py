"""Read the rows of one element of a binary PLY as columns."""

from __future__ import annotations

import struct
from array import array
from dataclasses import dataclass
from pathlib import Path
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from ...errors import InputError
from .ply_header import Element, Property

STRUCT_CODES = {"i1": "b", "u1": "B", "i2": "h", "u2": "H", "i4": "i", "u4": "I", "i8": "q",
                "u8": "Q", "f4": "f", "f8": "d"}  # fmt: skip


@dataclass(frozen=True)
class Table:
    """scalars: property → (n,); lists: property → (lengths (n,), values of all rows
    concatenated)."""

    count: int
    scalars: dict[str, NDArray]
    lists: dict[str, tuple[NDArray[np.int64], NDArray]]


def read_table(body: memoryview, start: int, element: Element, path: Path) -> tuple[Table, int]:
    """(the element whose first row starts at byte ``start``, start of the next element). Raises
    InputError where the file is too short for the rows."""
    if not element.properties:
        return Table(element.count, {}, {}), start
    min_row_bytes = sum(np.dtype(p.count_type or p.type).itemsize for p in element.properties)
    if element.count * min_row_bytes > len(body) - start:
        raise _truncated(element, path)
    if not any(p.count_type for p in element.properties):
        rows = np.frombuffer(body, _layout(element, {}), element.count, start)
        table = Table(element.count, {p.name: rows[p.name] for p in element.properties}, {})
        return table, start + rows.nbytes
    return _read_uniform(body, start, element) or _read_ragged(body, start, element, path)


def _layout(element: Element, lengths: dict[str, int]) -> np.dtype:
    """The dtype of a packed row whose lists have the given lengths."""
    fields: list[tuple] = []
    for i, p in enumerate(element.properties):
        if p.count_type is None:
            fields.append((p.name, p.type))
        else:
            fields += [(f"{i} count", p.count_type), (p.name, p.type, (lengths[p.name],))]
    return np.dtype(fields)


def _read_uniform(body: memoryview, start: int, element: Element) -> tuple[Table, int] | None:
    """The table where all lists are as long as in the first row (as with triangles); None
    otherwise."""
    if not element.count:
        return Table(0, {}, {p.name: (np.empty(0, np.int64), np.empty(0)) for p in
                             element.properties if p.count_type}), start  # fmt: skip
    lengths, at = {}, start
    for p in element.properties:
        kind = np.dtype(p.count_type or p.type)
        if at + kind.itemsize > len(body):
            return None
        if p.count_type is not None:
            count = np.frombuffer(body, kind, 1, at)[0]
            if not 0 <= count <= len(body):
                return None
            lengths[p.name] = int(count)
            at += int(count) * np.dtype(p.type).itemsize
        at += kind.itemsize
    if (at - start) * element.count > len(body) - start or at - start > 1 << 20:
        return None
    rows = np.frombuffer(body, _layout(element, lengths), element.count, start)
    scalars, lists = {}, {}
    for i, p in enumerate(element.properties):
        if p.count_type is None:
            scalars[p.name] = rows[p.name]
        else:
            if not (rows[f"{i} count"] == lengths[p.name]).all():
                return None
            lists[p.name] = (
                np.full(element.count, lengths[p.name], np.int64),
                _values(rows[p.name].reshape(-1), p.declared),
            )
    return Table(element.count, scalars, lists), start + rows.nbytes


def _read_ragged(body: memoryview, start: int, element: Element, path: Path) -> tuple[Table, int]:
    """The table of rows with different lengths, with one Python step for each list."""
    lists: list[_List] = []
    before = 0  # bytes of scalars since the start of the row or the last list
    scalars = {}  # name → (number of lists before it, bytes after the last of them)
    for p in element.properties:
        size = np.dtype(p.type).itemsize
        if p.count_type is None:
            scalars[p.name] = (len(lists), before)
            before += size
        else:
            lists.append(
                _List(
                    before,
                    struct.Struct(p.count_type[0] + STRUCT_CODES[p.count_type[1:]]),
                    size,
                    p,
                )
            )
            before = 0
    counts, end = _list_lengths(body, start, element, lists, before, path)
    # start of each part of a row: one part up to and including each list, and the tail
    lengths = np.empty((element.count, len(lists) + 1), np.int64)
    for k, one in enumerate(lists):
        lengths[:, k] = one.before + one.form.size + counts[:, k] * one.size
    lengths[:, -1] = before
    ends = np.cumsum(lengths.ravel()).reshape(lengths.shape)
    starts = ends - lengths + start
    raw = np.frombuffer(body, np.uint8)
    types = {p.name: p.type for p in element.properties}
    columns = {
        name: _gather(raw, starts[:, part] + offset, types[name])
        for name, (part, offset) in scalars.items()
    }
    found = {}
    for k, one in enumerate(lists):
        here = counts[:, k]
        within = np.arange(int(here.sum())) - np.repeat(np.cumsum(here) - here, here)
        first = np.repeat(starts[:, k] + one.before + one.form.size, here)
        values = _gather(raw, first + one.size * within, one.property.type)
        found[one.property.name] = (here, _values(values, one.property.declared))
    return Table(element.count, columns, found), end


class _List(NamedTuple):
    """before: bytes before the count; form: struct of the count; size: bytes of a value."""

    before: int
    form: struct.Struct
    size: int
    property: Property


def _list_lengths(
    body: memoryview, start: int, element: Element, lists: list[_List], tail_bytes: int, path: Path
) -> tuple[NDArray[np.int64], int]:
    """((n, lists) length of every list, end of the rows)."""
    lengths, total = array("q"), len(body)
    append, at = lengths.append, start
    steps = [(one.before, one.form.unpack_from, one.form.size, one.size) for one in lists]
    try:
        if len(steps) == 1 and lists[0].form.format in ("<B", ">B"):
            before, _, _, size = steps[0]
            more = before + 1 + tail_bytes
            for _ in range(element.count):
                count = body[at + before]
                append(count)
                at += more + count * size
        else:
            for _ in range(element.count):
                for before, unpack, width, size in steps:
                    at += before
                    count = int(unpack(body, at)[0])
                    if not 0 <= count <= total:
                        raise _truncated(element, path)
                    append(count)
                    at += width + count * size
                at += tail_bytes
    except (struct.error, IndexError, ValueError, OverflowError) as error:
        raise _truncated(element, path) from error
    if at > total:
        raise _truncated(element, path)
    return np.frombuffer(lengths, np.int64).reshape(element.count, len(lists)), at


def _gather(raw: NDArray[np.uint8], places: NDArray[np.int64], kind: str) -> NDArray:
    """(n,) the values of one type that start at those bytes."""
    size = np.dtype(kind).itemsize
    packed = np.empty((len(places), size), np.uint8)
    for k in range(size):
        packed[:, k] = raw[places + k]
    return packed.view(kind).ravel()


def _values(values: NDArray, declared: str) -> NDArray:
    """Integers as int64 (−1 where a double is not an integer), floats unchanged."""
    if declared[0] == "f":
        return values
    if values.dtype.kind == "f":
        whole = np.isfinite(values) & (np.abs(values) < 2.0**53)
        return np.where(whole & (np.floor(values) == values), values, -1).astype(np.int64)
    return values.astype(np.int64)


def _truncated(element: Element, path: Path) -> InputError:
    return InputError(
        f"is truncated: its header declares {element.count} elements of type "
        f"{element.name[:40]!r}, "
        "which do not fit into the file",
        file=path,
    )
