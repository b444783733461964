"""The rows of one element of a binary PLY, as columns."""

from __future__ import annotations

import struct
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from ...errors import InputError
from .ply_header import Element

LETTERS = {"i1": "b", "u1": "B", "i2": "h", "u2": "H", "i4": "i", "u4": "I", "i8": "q", "u8": "Q",
           "f4": "f", "f8": "d"}  # fmt: skip


@dataclass(frozen=True)
class Table:
    """scalars: property → (n,); lists: property → (lengths (n,), values of all rows in one)."""

    count: int
    scalars: dict[str, NDArray]
    lists: dict[str, tuple[NDArray[np.int64], NDArray]]


def read_table(body: memoryview, place: int, element: Element, path: Path) -> tuple[Table, int]:
    """The element whose first row stands at byte ``place``, and where the next one begins. Raises
    InputError where fewer bytes are left than the rows need."""
    if not element.properties:
        return Table(element.count, {}, {}), place
    least = sum(np.dtype(p.count_type or p.type).itemsize for p in element.properties)
    if element.count * least > len(body) - place:
        raise _truncated(element, path)
    if not any(p.count_type for p in element.properties):
        rows = np.frombuffer(body, _layout(element, {}), element.count, place)
        table = Table(element.count, {p.name: rows[p.name] for p in element.properties}, {})
        return table, place + rows.nbytes
    return _alike(body, place, element) or _walk(body, place, element, path)


def _layout(element: Element, lengths: dict[str, int]) -> np.dtype:
    """A packed row, where every list has the length given."""
    fields: list[tuple] = []
    for i, p in enumerate(element.properties):
        if p.count_type is None:
            fields.append((p.name, p.type))
        else:
            fields += [(f"{i} count", p.count_type), (p.name, p.type, (lengths[p.name],))]
    return np.dtype(fields)


def _alike(body: memoryview, place: int, element: Element) -> tuple[Table, int] | None:
    """The table where all rows have lists as long as the first row's, as all triangles have."""
    if not element.count:
        return Table(0, {}, {p.name: (np.empty(0, np.int64), np.empty(0)) for p in
                             element.properties if p.count_type}), place  # fmt: skip
    lengths, at = {}, place
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
    if (at - place) * element.count > len(body) - place or at - place > 1 << 20:
        return None
    rows = np.frombuffer(body, _layout(element, lengths), element.count, place)
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
    return Table(element.count, scalars, lists), place + rows.nbytes


def _walk(body: memoryview, place: int, element: Element, path: Path) -> tuple[Table, int]:
    """The table of rows of different lengths: one step a list."""
    # bytes of scalars before the list, its count, bytes of one value, place of the property
    steps: list[tuple[int, struct.Struct, int, int]] = []
    before, offsets = 0, {}
    for i, p in enumerate(element.properties):
        size = np.dtype(p.type).itemsize
        if p.count_type is None:
            offsets[p.name] = (len(steps), before)
            before += size
        else:
            order, kind = p.count_type[0], p.count_type[1:]
            steps.append((before, struct.Struct(order + LETTERS[kind]), size, i))
            before = 0
    tail, total = before, len(body)
    starts = np.empty((element.count, len(steps) + 1), np.int64)  # where the parts of a row begin
    counts = np.empty((element.count, len(steps)), np.int64)
    at = place
    try:
        for row in range(element.count):
            for k, (before, form, size, _) in enumerate(steps):
                starts[row, k] = at
                (count,) = form.unpack_from(body, at + before)
                if not 0 <= count <= total:
                    raise _truncated(element, path)
                counts[row, k] = count
                at += before + form.size + int(count) * size
            starts[row, -1] = at
            at += tail
    except (struct.error, ValueError) as error:
        raise _truncated(element, path) from error
    if at > total:
        raise _truncated(element, path)
    raw = np.frombuffer(body, np.uint8)
    scalars, lists = {}, {}
    for name, (part, offset) in offsets.items():
        p = next(p for p in element.properties if p.name == name)
        scalars[name] = _gather(raw, starts[:, part] + offset, p.type)
    for k, (before, form, size, i) in enumerate(steps):
        p = element.properties[i]
        lengths = counts[:, k]
        within = np.arange(int(lengths.sum())) - np.repeat(np.cumsum(lengths) - lengths, lengths)
        first = np.repeat(starts[:, k] + before + form.size, lengths)
        lists[p.name] = (lengths, _values(_gather(raw, first + size * within, p.type), p.declared))
    return Table(element.count, scalars, lists), at


def _gather(raw: NDArray[np.uint8], places: NDArray[np.int64], kind: str) -> NDArray:
    """(n,) the numbers of one type that begin at those bytes."""
    size = np.dtype(kind).itemsize
    packed = np.empty((len(places), size), np.uint8)
    for k in range(size):
        packed[:, k] = raw[places + k]
    return packed.view(kind).ravel()


def _values(values: NDArray, declared: str) -> NDArray:
    """Whole numbers as int64 (-1 where a double cannot be one), others as they are."""
    if declared[0] == "f":
        return values
    if values.dtype.kind == "f":
        whole = np.isfinite(values) & (np.abs(values) < 2.0**53)
        return np.where(whole & (np.floor(values) == values), values, -1).astype(np.int64)
    return values.astype(np.int64)


def _truncated(element: Element, path: Path) -> InputError:
    return InputError(
        f"is truncated: its header says {element.count} elements of kind {element.name[:40]!r}, "
        "and there is not enough for them",
        file=path,
    )
