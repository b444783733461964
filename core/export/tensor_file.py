"""The container of RGL's measured BRDFs (`.bsdf`): named arrays in one file.

Format of Mitsuba 3 (`TensorFile`) and pbrt-v4: "tensor_file\\0", version (1, 0), number of fields
(uint32); then for each field: length of its name (uint16), name, number of dimensions (uint16),
type (uint8), offset of its data in the file (uint64), shape (uint64 each). Little endian.
"""

from __future__ import annotations

import struct
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ..files import atomic_path

MAGIC = b"tensor_file\0"
TYPES = {"uint8": 1, "float32": 10}
ALIGNMENT = 8


def write(path: Path, fields: Mapping[str, NDArray[Any]]) -> None:
    """Write uint8 and float32 arrays by name, atomically: a failed write leaves no partial file."""
    arrays = {name: np.ascontiguousarray(value) for name, value in fields.items()}
    head = (
        len(MAGIC)
        + 2
        + 4
        + sum(2 + len(name.encode()) + 2 + 1 + 8 + 8 * value.ndim for name, value in arrays.items())
    )
    place = _aligned(head)
    index = [MAGIC, struct.pack("<BBI", 1, 0, len(arrays))]
    for name, value in arrays.items():
        label = name.encode()
        index.append(struct.pack("<H", len(label)) + label)
        index.append(struct.pack("<HBQ", value.ndim, TYPES[value.dtype.name], place))
        index.append(struct.pack(f"<{value.ndim}Q", *value.shape))
        place = _aligned(place + value.nbytes)
    with atomic_path(path) as partial, open(partial, "wb") as file:
        file.write(b"".join(index))
        for value in arrays.values():
            file.write(bytes(_aligned(file.tell()) - file.tell()))
            file.write(value.astype(value.dtype.newbyteorder("<")).tobytes())


def _aligned(place: int) -> int:
    """The next multiple of ALIGNMENT, in bytes."""
    return -(-place // ALIGNMENT) * ALIGNMENT
