"""Objects as files that another process reads: the request and the answer of a child process.

Arrays are stored apart from the rest of an object (pickle protocol 5, PEP 574) and are mapped into
memory when they are read: reading takes milliseconds, whatever their size. Objects of classes with
the attribute ``STORED_APART`` get a file of their own. An object that was read from such a file is
referred to by its path when it is written again: a kept result is not copied.

Pickle runs code that a file names. These files are written and read only by a process and its
child, in a folder that no other user can open.
"""

from __future__ import annotations

import io
import mmap
import pickle
import shutil
import weakref
from collections.abc import Callable, Iterable, Sequence
from pathlib import Path
from typing import Any

PACKAGE = __package__.rsplit(".", 2)[0]
"""The name of Patina in this process; in Blender it is longer than in a child."""
ALIGNMENT = 64  # bytes, of the start of each array: as numpy aligns its own
OBJECT, ARRAYS = ".object", ".arrays"  # endings of the two files


class _Known:
    """The objects of this process that are stored in files."""

    def __init__(self) -> None:
        self._of_path: dict[str, weakref.ref[Any]] = {}
        self._of_object: dict[int, tuple[weakref.ref[Any], str]] = {}
        self._owned: set[str] = set()
        self._unused: set[Path] = set()  # files that could not be deleted yet

    def add(self, path: Path, value: object) -> None:
        name, number = str(path), id(value)

        def forget(gone: weakref.ref[Any]) -> None:
            self._forget(name, number, gone)

        reference = weakref.ref(value, forget)
        self._of_path[name] = reference
        self._of_object[number] = reference, name

    def value(self, path: Path) -> object | None:
        """The object of that file, None where it is not in memory."""
        reference = self._of_path.get(str(path))
        return None if reference is None else reference()

    def path(self, value: object) -> str | None:
        """The file of an object, None where it has none, or where it is gone: temporary folders are
        cleaned at times."""
        reference, name = self._of_object.get(id(value), (None, None))
        if name is None or reference is None or reference() is not value:
            return None
        return name if all(file.is_file() for file in _files(Path(name))) else None

    def own(self, folder: Path) -> None:
        """Delete each file of the folder when its object is not in memory any more, and then the
        folder."""
        self._owned.add(str(folder))
        kept = {file for name in self._of_path for file in _files(Path(name))}
        self._unused |= {file for file in folder.iterdir() if file not in kept}
        self.delete_unused()

    def delete_unused(self) -> None:
        """Delete what can be deleted: Windows keeps files whose arrays are still in memory."""
        for file in list(self._unused):
            try:
                if file.is_dir():
                    shutil.rmtree(file)
                else:
                    file.unlink(missing_ok=True)
            except OSError:
                continue
            self._unused.discard(file)
        for folder in list(self._owned):
            try:
                Path(folder).rmdir()
            except FileNotFoundError:
                pass
            except OSError:  # it is not empty
                continue
            self._owned.discard(folder)

    def _forget(self, name: str, number: int, gone: weakref.ref[Any]) -> None:
        if self._of_path.get(name) is gone:
            del self._of_path[name]
        if self._of_object.get(number, (None,))[0] is gone:
            del self._of_object[number]
        if str(Path(name).parent) in self._owned:
            self._unused |= set(_files(Path(name)))
            self.delete_unused()


def _files(path: Path) -> tuple[Path, Path]:
    """The two files of an object."""
    return path.with_name(path.name + OBJECT), path.with_name(path.name + ARRAYS)


_known = _Known()


def write_object(path: Path, value: object) -> None:
    """Write an object. path: without ending; its folder must exist. Raises OSError, and what pickle
    raises for an object that cannot be stored."""
    _write(path, (value,), {})


def read_object(path: Path, changes: bool = False) -> Any:
    """The object that was written to this path. changes: the object, with the parts that were
    written with it, will change, so that it is never referred to by its path. Raises OSError, and
    what pickle raises for a file that is damaged."""
    return _read(path, {}, path.parent if changes else None)[0]


def own_folder(folder: Path) -> None:
    """Delete each file of the folder as soon as its object is not in memory, and the folder with
    the last one."""
    if folder.is_dir():
        _known.own(folder)


def delete_unused() -> None:
    """Try again to delete files of objects that are not in memory."""
    _known.delete_unused()


def _write(path: Path, value: object, written: dict[int, str]) -> None:
    """written: path of each object that this call of write_object has stored apart, by id()."""
    spans: list[tuple[int, int]] = []
    content = io.BytesIO()
    with path.with_name(path.name + ARRAYS).open("xb") as arrays:

        def keep(buffer: pickle.PickleBuffer) -> None:
            arrays.write(b"\0" * (-arrays.tell() % ALIGNMENT))
            array = buffer.raw()
            spans.append((arrays.tell(), array.nbytes))
            arrays.write(array)

        _Writer(content, path, value, keep, written).dump(value)
    stored = pickle.dumps((PACKAGE, spans, content.getvalue()), protocol=5)
    path.with_name(path.name + OBJECT).write_bytes(stored)


def _read(path: Path, read: dict[str, Any], changing: Path | None) -> Any:
    """read: the objects that this call of read_object has read, by path; changing: the folder whose
    objects will change."""
    package, spans, content = pickle.loads(path.with_name(path.name + OBJECT).read_bytes())
    arrays = _mapped(path.with_name(path.name + ARRAYS), spans)
    return _Reader(content, arrays, package, read, changing).load()


class _Writer(pickle.Pickler):
    def __init__(
        self,
        out: io.BytesIO,
        path: Path,
        root: object,
        keep: Callable[[pickle.PickleBuffer], None],
        written: dict[int, str],
    ) -> None:
        super().__init__(out, protocol=5, buffer_callback=keep)
        self._path, self._root, self._written = path, root, written

    def persistent_id(self, value: Any) -> str | None:
        """The path of an object that is stored apart."""
        if not getattr(type(value), "STORED_APART", False) or value is self._root:
            return None
        found = _known.path(value) or self._written.get(id(value))
        if found is None:
            stem = self._path.name.split("-")[0]
            found = str(self._path.with_name(f"{stem}-{len(self._written) + 1}"))
            self._written[id(value)] = found
            _write(Path(found), value, self._written)
        return found


class _Reader(pickle.Unpickler):
    def __init__(
        self,
        content: bytes,
        arrays: Iterable[memoryview],
        package: str,
        read: dict[str, Any],
        changing: Path | None,
    ) -> None:
        super().__init__(io.BytesIO(content), buffers=arrays)
        self._package, self._read, self._changing = package, read, changing

    def find_class(self, module: str, name: str) -> Any:
        """Names of Patina's own modules are those of this process."""
        if module == self._package or module.startswith(self._package + "."):
            module = PACKAGE + module[len(self._package) :]
        return super().find_class(module, name)

    def persistent_load(self, path: str) -> Any:
        """The object that is stored apart."""
        file = Path(path)
        found = self._read.get(path) or _known.value(file)
        if found is None:
            found = _read(file, self._read, self._changing)
            if file.parent != self._changing:
                _known.add(file, found)
        self._read[path] = found
        return found


def _mapped(path: Path, spans: Sequence[tuple[int, int]]) -> list[memoryview]:
    """The arrays of a file; changes of them are private to this process."""
    if not any(size for _, size in spans):
        return [memoryview(bytearray()) for _ in spans]
    with path.open("rb") as file:
        content = memoryview(mmap.mmap(file.fileno(), 0, access=mmap.ACCESS_COPY))
    return [content[begin : begin + size] for begin, size in spans]
