"""The bytes of a glTF: its JSON, its buffers, and the arrays ("accessors") in them.

Khronos Group, glTF 2.0 specification (2021), sections 3.6 (buffers) and 4.4 (GLB).
"""

from __future__ import annotations

import base64
import binascii
import json
import struct
from pathlib import Path
from typing import Any, NoReturn
from urllib.parse import unquote

import numpy as np
from numpy.typing import NDArray

from ...errors import InputError
from .texture_path import resolve_inside

MAGIC, JSON_CHUNK, BIN_CHUNK = 0x46546C67, 0x4E4F534A, 0x004E4942
COMPONENTS = {5120: "<i1", 5121: "<u1", 5122: "<i2", 5123: "<u2", 5125: "<u4", 5126: "<f4"}
WIDTHS = {"SCALAR": 1, "VEC2": 2, "VEC3": 3, "VEC4": 4}
COMPRESSED = {
    "KHR_draco_mesh_compression": "Draco",
    "EXT_meshopt_compression": "meshopt",
    "KHR_meshopt_compression": "meshopt",
}
# extensions a file may require that do not affect what is read here (prefixes)
IGNORED_EXTENSIONS = ("KHR_materials_", "KHR_texture_", "EXT_texture_", "KHR_lights_", "KHR_xmp")
SUPPORTED_EXTENSIONS = ("KHR_mesh_quantization",)
MAX_JSON_BYTES = 256 << 20
# bytes of arrays that any file may expand to; a larger file 20 times its size
MIN_ARRAY_BUDGET = 64 << 20


class Gltf:
    """A glTF document. Its JSON is checked at every access: the accessors raise InputError with the
    location of an invalid value."""

    def __init__(self, data: bytes, path: Path) -> None:
        self.path = path
        text, self._binary = _chunks(data, path) if path.suffix.lower() == ".glb" else (data, None)
        if len(text) > MAX_JSON_BYTES:
            raise InputError(
                f"its JSON has {len(text) >> 20} MiB; expected at most 256 MiB", file=path
            )
        try:
            self.json = json.loads(text.decode("utf-8-sig"), parse_constant=_no_constant)
        except (ValueError, RecursionError) as error:
            raise InputError(f"its JSON cannot be read ({_short(error)})", file=path) from error
        if not isinstance(self.json, dict):
            raise InputError("its JSON is not a glTF document", file=path)
        version = self.member(self.json, "asset", dict, {}).get("version")
        if not isinstance(version, str) or not version.startswith("2."):
            raise InputError(f"is glTF {str(version)[:20]!r}; expected 2.0", file=path)
        self._buffers: dict[int, memoryview] = {}
        self._arrays_left = max(MIN_ARRAY_BUDGET, 20 * len(data))
        self._refuse_extensions()

    def error(self, message: str) -> InputError:
        """An InputError about this file."""
        return InputError(message, file=self.path)

    def member(self, holder: dict, key: str, kind: type | tuple[type, ...], default: Any) -> Any:
        """A member of a JSON object with that type; the default where it is missing."""
        value = holder.get(key, default)
        if value is default:
            return default
        if not isinstance(value, kind) or (isinstance(value, bool) and kind is not bool):
            raise self.error(f"glTF: {key!r} does not have the type that the format requires")
        return value

    def entry(self, name: str, index: Any) -> dict:
        """An object of one of the document's arrays: ``nodes``, ``meshes`` …"""
        entries = self.member(self.json, name, list, [])
        if not isinstance(index, int) or isinstance(index, bool) or not 0 <= index < len(entries):
            raise self.error(f"glTF: {name}[{str(index)[:20]}] does not exist")
        if not isinstance(entries[index], dict):
            raise self.error(f"glTF: {name}[{index}] is not an object")
        return entries[index]

    def spend(self, size: int) -> None:
        """Subtract bytes from the memory budget of a file of this size. Raises InputError when it
        is used up."""
        self._arrays_left -= size
        if self._arrays_left < 0:
            raise self.error(
                "glTF: its meshes are repeated so often that they do not fit into memory"
            )

    def accessor(self, index: Any, width: int) -> NDArray:
        """(n, width) the values of an accessor: float32 where stored as float or normalised,
        otherwise integers of the stored type."""
        entry = self.entry("accessors", index)
        kind = COMPONENTS.get(self.member(entry, "componentType", int, 0))
        components = WIDTHS.get(self.member(entry, "type", str, ""))
        if kind is None or components is None or components < width:
            raise self.error(f"glTF: accessors[{index}] has an unexpected type")
        count = self._size(entry, "count")
        dtype = np.dtype(kind)
        if "bufferView" in entry:
            stored = self._view(entry, count, dtype, components)
        else:
            self.spend(count * components * dtype.itemsize)
            stored = np.zeros((count, components), dtype)
        if "sparse" in entry:
            stored = self._with_sparse(entry, stored)
        self.spend(stored.nbytes)
        stored = stored[:, :width]
        if self.member(entry, "normalized", bool, False) and dtype.kind in "iu":
            return np.maximum(stored / np.float32(np.iinfo(dtype).max), np.float32(-1))
        return stored

    def _view(self, entry: dict, count: int, dtype: np.dtype, components: int) -> NDArray:
        """(count, components) values of a bufferView, at the entry's byteOffset."""
        view = self.entry("bufferViews", entry.get("bufferView"))
        buffer = self._buffer(view.get("buffer"))
        offset, length = self._size(view, "byteOffset", 0), self._size(view, "byteLength")
        if offset + length > len(buffer):
            raise self.error("glTF: a bufferView reaches beyond its buffer: the file is truncated")
        start = self._size(entry, "byteOffset", 0)
        row = components * dtype.itemsize
        stride = self._size(view, "byteStride", row) or row
        if stride < row or (count and start + stride * (count - 1) + row > length):
            raise self.error("glTF: an accessor reaches beyond its bufferView")
        if not count:
            return np.empty((0, components), dtype)
        return np.ndarray(
            (count, components), dtype, buffer, offset + start, (stride, dtype.itemsize)
        )

    def _with_sparse(self, entry: dict, stored: NDArray) -> NDArray:
        sparse = self.member(entry, "sparse", dict, {})
        count = self._size(sparse, "count")
        index_entry = self.member(sparse, "indices", dict, {})
        kind = COMPONENTS.get(self.member(index_entry, "componentType", int, 0), "")
        if kind not in ("<u1", "<u2", "<u4"):
            raise self.error("glTF: sparse indices have an unexpected type")
        places = self._view(index_entry, count, np.dtype(kind), 1)[:, 0]
        values = self._view(
            self.member(sparse, "values", dict, {}), count, stored.dtype, stored.shape[1]
        )
        if count and int(places.max()) >= len(stored):
            raise self.error("glTF: a sparse index is out of range")
        changed = stored.copy()
        changed[places] = values
        return changed

    def _size(self, holder: dict, key: str, default: int | None = None) -> int:
        value = holder.get(key, default)
        if not isinstance(value, int) or isinstance(value, bool) or not 0 <= value < 1 << 48:
            raise self.error(f"glTF: {key!r} is missing or not a number of bytes or elements")
        return value

    def _buffer(self, index: Any) -> memoryview:
        entry = self.entry("buffers", index)
        if index not in self._buffers:
            content = self._content(entry, index)
            length = self._size(entry, "byteLength")
            if len(content) < length:
                raise self.error(
                    f"glTF: buffers[{index}] should have {length} bytes and has {len(content)}: "
                    "the file is truncated"
                )
            self._buffers[index] = memoryview(content)[:length]
        return self._buffers[index]

    def _content(self, entry: dict, index: int) -> bytes:
        uri = self.member(entry, "uri", str, None)
        if uri is None:
            if index != 0 or self._binary is None:
                raise self.error(f"glTF: buffers[{index}] has no content")
            return self._binary
        if uri.startswith("data:"):
            head, comma, body = uri.partition(",")
            if not comma or not head.endswith(";base64"):
                raise self.error(f"glTF: the data URI of buffers[{index}] is not base64")
            try:
                return base64.b64decode(body, validate=True)
            except (binascii.Error, ValueError) as error:
                raise self.error(f"glTF: the data URI of buffers[{index}] is damaged") from error
        file = resolve_inside(self.path, unquote(uri))
        if file is None:
            raise self.error(f"glTF: buffers[{index}] is not in the mesh's folder; copy it there")
        try:
            if not file.is_file():
                raise self.error(f"glTF: {file.name!r} is missing from the mesh's folder")
            # no more than the document declares
            with open(file, "rb") as stream:
                content = stream.read(min(self._size(entry, "byteLength"), file.stat().st_size))
        except OSError as error:
            raise self.error(f"glTF: {file.name!r} cannot be read ({error.strerror})") from error
        self._arrays_left += 20 * len(content)
        return content

    def _refuse_extensions(self) -> None:
        required = self.member(self.json, "extensionsRequired", list, [])
        for name in required:
            if isinstance(name, str) and name in COMPRESSED:
                self.refuse_compressed(name)
            known = isinstance(name, str) and (
                name in SUPPORTED_EXTENSIONS or name.startswith(IGNORED_EXTENSIONS)
            )
            if not known:
                raise self.error(
                    f"requires the glTF extension {str(name)[:60]!r}, which is not supported"
                )

    def refuse_compressed(self, name: str) -> NoReturn:
        """Raise the InputError of compressed geometry."""
        raise self.error(
            f"its geometry is compressed with {COMPRESSED[name]} ({name}), which is not supported; "
            "export it without compression"
        )


def _chunks(data: bytes, path: Path) -> tuple[bytes, bytes | None]:
    """(JSON chunk, binary chunk) of a GLB."""
    if len(data) < 20 or struct.unpack_from("<I", data)[0] != MAGIC:
        raise InputError("is not a GLB file, or is truncated", file=path)
    _, version, length = struct.unpack_from("<III", data)
    if version != 2:
        raise InputError(f"is GLB version {version}; expected 2", file=path)
    if length > len(data):
        raise InputError(
            f"is truncated: its header declares {length} bytes; the file has {len(data)}", file=path
        )
    chunks: list[tuple[int, bytes]] = []
    position = 12
    while position + 8 <= length and len(chunks) < 2:
        size, kind = struct.unpack_from("<II", data, position)
        if position + 8 + size > length:
            raise InputError("a chunk of the GLB is longer than the file", file=path)
        chunks.append((kind, data[position + 8 : position + 8 + size]))
        position += 8 + size
    if not chunks or chunks[0][0] != JSON_CHUNK:
        raise InputError("the GLB does not begin with its JSON", file=path)
    binary = chunks[1][1] if len(chunks) > 1 and chunks[1][0] == BIN_CHUNK else None
    return chunks[0][1], binary


def _no_constant(name: str) -> float:
    raise ValueError(f"{name} is not a number")


def _short(error: Exception) -> str:
    return str(error)[:100] or type(error).__name__
