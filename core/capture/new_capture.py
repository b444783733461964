"""Write a new capture file (`*.capture.toml`) from cameras, a mesh and lit photos."""

from __future__ import annotations

import contextlib
import json
import os
from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from pathlib import Path

from ..counted import listed
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


@dataclass(frozen=True)
class SortedFiles:
    """Files sorted by kind. cameras: a COLMAP model is represented by its folder."""

    cameras: tuple[Path, ...]
    meshes: tuple[Path, ...]
    photos: tuple[Path, ...]


@dataclass(frozen=True)
class LampText:
    """The lamp of a new capture as TOML. location_line: gives its direction or position, and states
    whether that is a guess."""

    location_line: str

    @classmethod
    def flash(cls, offset: Sequence[float], guess: bool = False) -> LampText:
        """A flash on the camera. offset: right, down, forward of the lens, scan units."""
        return cls(
            f"mounted = {_numbers(offset)}  # right, down, forward of the lens{_mark(guess)}"
        )

    @classmethod
    def sun(cls) -> LampText:
        """The sun, from the time and place in the photos' EXIF."""
        return cls("sun = {}  # from the photos' time and place")

    @classmethod
    def distant(cls, direction: Sequence[float], guess: bool = False) -> LampText:
        """A distant lamp. direction: (3,) from the surface to the lamp, scan frame."""
        return cls(
            f"direction = {_numbers(direction)}  # from the surface to the lamp{_mark(guess)}"
        )

    @classmethod
    def near(cls, position: Sequence[float], guess: bool = False) -> LampText:
        """A near lamp. position: (3,) scan frame."""
        return cls(f"position = {_numbers(position)}  # of the lamp{_mark(guess)}")


@dataclass(frozen=True)
class PhotoText:
    """A lit photo of a new capture. camera: label in the scan; light: name of its lamp."""

    file: Path
    camera: str
    light: str


def sort_files(paths: Iterable[Path]) -> SortedFiles:
    """Sort files by their suffix. Raises InputError for a file of no known kind."""
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
            raise InputError(
                "has an unknown file type; expected cameras, a mesh or a photo", file=path
            )
    return SortedFiles(tuple(dict.fromkeys(cameras)), tuple(meshes), tuple(photos))


def model_of(path: Path) -> Path:
    """The path that names the cameras: for a file of a COLMAP model, its folder."""
    return path.parent if path.suffix.lower() in COLMAP else path


def mesh_in_folder(cameras: Path) -> Path | None:
    """The only mesh in the folder of the cameras, or next to the folder of a COLMAP model; None
    where there is no mesh or more than one."""
    near = [cameras.parent, cameras.parent.parent] if cameras.is_dir() else [cameras.parent]
    for folder in near:
        with contextlib.suppress(OSError):
            found = [p for p in sorted(folder.iterdir()) if p.suffix.lower() in READERS]
            if found:
                return found[0] if len(found) == 1 else None
    return None


def free_name(folder: Path, stem: str) -> Path:
    """A path for a capture file that does not exist yet."""
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
    lamp: LampText,
    images: Path | None = None,
    chunk: str | None = None,
) -> None:
    """Write a capture of photos lit by one lamp; each photo gets the camera of the same name.

    images: folder of the scan's own photos. chunk: of a project with several. The file appears
    only after it has been read back. Raises InputError.
    """
    if not photos:
        raise InputError("no photo is selected; expected at least one lit photo", key="photos")
    found = read_reconstruction(cameras, images, chunk)
    labels = {photo: find_camera(found.cameras, photo.name) for photo in photos}
    lost = [photo.name for photo, camera in labels.items() if camera is None]
    if lost:
        raise InputError(
            f"{len(lost)} of {len(photos)} photos have no camera of the same name: {listed(lost)}; "
            "expected each lit photo to have the name of the scan photo from the same viewpoint: "
            "rename them, or use the command `localise` to find their viewpoints",
            file=cameras,
        )
    rows = [PhotoText(photo, found.label, "lamp") for photo, found in labels.items() if found]
    write_capture(out, cameras, mesh, rows, [("lamp", lamp)], images, chunk)


def write_capture(
    out: Path,
    cameras: Path,
    mesh: Path,
    photos: Sequence[PhotoText],
    lamps: Sequence[tuple[str, LampText]],
    images: Path | None = None,
    chunk: str | None = None,
    extra: Path | None = None,
) -> None:
    """Write a capture file. The file appears only after it has been read back. Raises InputError.

    lamps: (name, lamp). images: folder of the scan's own photos. chunk: of a project with several.
    extra: file of localised cameras.
    """
    scan = {"cameras": cameras, "mesh": mesh, "images": images, "extra": extra}
    lines = ["[scan]", *(f"{k} = {_path(p, out)}" for k, p in scan.items() if p is not None)]
    if chunk is not None:
        lines.append(f"chunk = {_text(chunk)}")
    for name, lamp in lamps:
        lines += ["", "[[light]]", f"name = {_text(name)}", lamp.location_line]
    for photo in photos:
        lines += ["", "[[photo]]", f"file = {_path(photo.file, out)}"]
        lines += [f"camera = {_text(photo.camera)}", f"light = {_text(photo.light)}"]
    _write(out, "\n".join([*lines, ""]))


def _write(out: Path, text: str) -> None:
    try:
        with atomic_path(out) as partial:
            partial.write_text(text, "utf-8")
            read_capture(partial)
    except OSError as error:
        raise InputError(f"cannot be written ({error.strerror or error})", file=out) from error


def _path(path: Path, out: Path) -> str:
    """A path as TOML, relative to the capture file where possible."""
    with contextlib.suppress(ValueError):  # a path on another drive stays absolute
        path = Path(os.path.relpath(path.resolve(), out.resolve().parent))
    return _text(path.as_posix())


def _text(text: str) -> str:
    """A TOML string; JSON strings are a subset of TOML's."""
    return json.dumps(text, ensure_ascii=False)


def _mark(guess: bool) -> str:
    """The line that marks a placeholder."""
    return "\nguess = true" if guess else ""


def _numbers(values: Sequence[float]) -> str:
    return f"[{', '.join(repr(round(float(v), 6)) for v in values)}]"
