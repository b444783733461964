"""A capture file of one's own: cameras, mesh and lit photos that lie about → `*.capture.toml`."""

from __future__ import annotations

import contextlib
import json
import os
from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from pathlib import Path

from ..errors import InputError
from ..files import atomic_path
from ..photo.container import KIND_OF, RAW
from ..scan.formats import BY_SUFFIX, read_reconstruction
from ..scan.mesh import READERS
from ..scan.scan import find_camera
from .reader import read_capture

PHOTOS = frozenset((*KIND_OF, *RAW))
COLMAP = frozenset((".bin", ".txt"))
CAMERAS = frozenset((*BY_SUFFIX, ".json", *COLMAP))
LISTED = 3  # names in a message


@dataclass(frozen=True)
class Given:
    """Files by what they are. cameras: a COLMAP model is its folder."""

    cameras: tuple[Path, ...]
    meshes: tuple[Path, ...]
    photos: tuple[Path, ...]


@dataclass(frozen=True)
class LampWords:
    """The one lamp of a new capture, as TOML: ``words`` is the line that says where it is."""

    words: str

    @classmethod
    def flash(cls, offset: Sequence[float]) -> LampWords:
        """On the camera. offset: right, down, forward of the lens, scan units."""
        return cls(f"mounted = {_numbers(offset)}  # right, down, forward of the lens")

    @classmethod
    def sun(cls) -> LampWords:
        """Where the photos' own time and place have it."""
        return cls("sun = {}  # as the photos' time and place say")

    @classmethod
    def distant(cls, direction: Sequence[float]) -> LampWords:
        """direction: from the surface to the lamp, scan frame."""
        return cls(f"direction = {_numbers(direction)}  # from the surface to the lamp")


def sort_files(paths: Iterable[Path]) -> Given:
    """Files by their suffix. Raises InputError for one that is of no use."""
    cameras: list[Path] = []
    meshes: list[Path] = []
    photos: list[Path] = []
    for path in dict.fromkeys(paths):
        suffix = path.suffix.lower()
        if suffix in PHOTOS:
            photos.append(path)
        elif suffix in READERS:
            meshes.append(path)
        elif suffix in CAMERAS:
            cameras.append(model_of(path))
        else:
            raise InputError("is neither cameras nor a mesh nor a photo that is read", file=path)
    return Given(tuple(dict.fromkeys(cameras)), tuple(meshes), tuple(photos))


def model_of(path: Path) -> Path:
    """What is named as the cameras: of a COLMAP model the folder that its files lie in."""
    return path.parent if path.suffix.lower() in COLMAP else path


def mesh_beside(cameras: Path) -> Path | None:
    """The only mesh beside the cameras, or beside the folders of their model; None where there is
    none or a choice."""
    near = [cameras.parent, cameras.parent.parent] if cameras.is_dir() else [cameras.parent]
    for folder in near:
        with contextlib.suppress(OSError):
            found = [p for p in sorted(folder.iterdir()) if p.suffix.lower() in READERS]
            if found:
                return found[0] if len(found) == 1 else None
    return None


def free_name(folder: Path, stem: str) -> Path:
    """A capture file that is not there yet."""
    out, count = folder / f"{stem}.capture.toml", 1
    while out.exists():
        count += 1
        out = folder / f"{stem} {count}.capture.toml"
    return out


def write_new_capture(
    out: Path,
    cameras: Path,
    mesh: Path,
    photos: Sequence[Path],
    lamp: LampWords,
    images: Path | None = None,
    chunk: str | None = None,
) -> None:
    """Write a capture of photos lit by one lamp, each taken by the camera that is named like it.

    images: folder of the scan's own photos. chunk: of a project with several. The file appears
    only after it has been read back. Raises InputError.
    """
    if not photos:
        raise InputError("choose at least one lit photo", key="photos")
    found = read_reconstruction(cameras, images, chunk)
    labels = {photo: find_camera(found.cameras, photo.name) for photo in photos}
    lost = [photo.name for photo, camera in labels.items() if camera is None]
    if lost:
        some = ", ".join(lost[:LISTED]) + (" …" if len(lost) > LISTED else "")
        raise InputError(
            f"{len(lost)} of {len(photos)} photos have no camera of their name: {some}; a lit "
            "photo is called as the scan's photo from the same place, else the command `localise` "
            "finds where it was taken from",
            file=cameras,
        )
    scan = {"cameras": cameras, "mesh": mesh, "images": images}
    lines = ["[scan]", *(f"{k} = {_path(p, out)}" for k, p in scan.items() if p is not None)]
    if chunk is not None:
        lines.append(f"chunk = {_text(chunk)}")
    lines += ["", "[[light]]", 'name = "lamp"', lamp.words, ""]
    for photo, camera in labels.items():
        assert camera is not None  # those without are refused above
        lines += ["[[photo]]", f"file = {_path(photo, out)}", f"camera = {_text(camera.label)}"]
        lines += ['light = "lamp"', ""]
    _write(out, "\n".join(lines))


def _write(out: Path, text: str) -> None:
    try:
        with atomic_path(out) as partial:
            partial.write_text(text, "utf-8")
            read_capture(partial)
    except OSError as error:
        raise InputError(f"cannot be written ({error.strerror or error})", file=out) from error


def _path(path: Path, out: Path) -> str:
    """Relative to the capture file where it can be."""
    with contextlib.suppress(ValueError):  # on another drive: stays absolute
        path = Path(os.path.relpath(path.resolve(), out.resolve().parent))
    return _text(path.as_posix())


def _text(text: str) -> str:
    """As TOML has it: what JSON writes is a subset."""
    return json.dumps(text, ensure_ascii=False)


def _numbers(values: Sequence[float]) -> str:
    return f"[{', '.join(repr(round(float(v), 6)) for v in values)}]"
