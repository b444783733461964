"""Sort files and folders by their content into cameras, meshes and photos."""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from dataclasses import dataclass
from pathlib import Path

from ..capture.new_capture import PHOTOS
from ..errors import InputError, PatinaError
from ..photo import image_size
from ..scan import Camera, Mesh
from ..scan.formats import BY_SUFFIX, read_reconstruction
from ..scan.mesh import READERS, read_mesh
from ..scan.readers.colmap import is_colmap

MAX_DEPTH = 3  # of folders inside a chosen folder
MAX_FILES = 20_000
LOCALISED = ".cameras.json"  # ending of the files that localise writes


@dataclass(frozen=True)
class FoundFiles:
    """Files by kind, as their names suggest. cameras: files, or folders of a COLMAP model.
    localised: files of cameras that were added to a scan later."""

    cameras: tuple[Path, ...]
    meshes: tuple[Path, ...]
    photos: tuple[Path, ...]
    localised: tuple[Path, ...] = ()


@dataclass(frozen=True)
class ReadableCameras:
    """path: of the file or folder; cameras: in it, in its own frame."""

    path: Path
    cameras: tuple[Camera, ...]


def sort_paths(paths: Iterable[Path]) -> FoundFiles:
    """Files and folders by kind; of a folder everything down to MAX_DEPTH. Raises InputError for a
    path that does not exist."""
    cameras: dict[Path, None] = {}
    meshes: dict[Path, None] = {}
    photos: dict[Path, None] = {}
    for given in paths:
        if not given.exists():
            raise InputError("no such file or folder", file=given)
        for path in _files(given) if given.is_dir() else (given,):
            suffix = path.suffix.lower()
            model = path if path.is_dir() else path.parent
            if path.is_dir() or (suffix in (".bin", ".txt") and is_colmap(model)):
                cameras[model] = None
            elif suffix in PHOTOS:
                photos[path] = None
            elif suffix in READERS:
                meshes[path] = None
            elif suffix == ".json" or suffix in BY_SUFFIX:
                cameras[path] = None
    localised = [path for path in cameras if path.name.endswith(LOCALISED)]
    if len(localised) == len(cameras):  # nothing that they could be added to
        localised = []
    return FoundFiles(
        tuple(path for path in cameras if path not in localised),
        tuple(meshes),
        tuple(photos),
        tuple(localised),
    )


def _files(folder: Path, depth: int = 0) -> Iterator[Path]:
    """Visible files of a folder and its subfolders; a COLMAP model is its folder."""
    if is_colmap(folder):
        yield folder
    try:
        inside = sorted(folder.iterdir())
    except OSError as error:
        raise InputError(f"cannot be read ({error.strerror})", file=folder) from error
    if len(inside) > MAX_FILES:
        raise InputError(
            f"holds {len(inside)} files; expected at most {MAX_FILES}: choose a folder with only "
            "this object's files",
            file=folder,
        )
    for path in inside:
        if path.name.startswith("."):
            continue
        if path.is_dir():
            if depth < MAX_DEPTH:
                yield from _files(path, depth + 1)
        elif not (path.suffix.lower() in (".bin", ".txt") and is_colmap(folder)):
            yield path


def best_cameras(paths: Iterable[Path]) -> tuple[ReadableCameras | None, tuple[str, ...]]:
    """(the camera file with the most cameras, why others cannot be read)."""
    found: ReadableCameras | None = None
    problems = []
    for path in paths:
        try:
            cameras = read_reconstruction(path).cameras
        except PatinaError as error:
            problems.append(str(error))
            continue
        if found is None or len(cameras) > len(found.cameras):
            found = ReadableCameras(path, tuple(cameras))
    return found, tuple(problems)


def best_mesh(paths: Iterable[Path]) -> tuple[Path | None, Mesh | None, tuple[str, ...]]:
    """(the mesh file with the most faces, its mesh, why others cannot be read). A file of points
    without faces is no mesh."""
    best: tuple[Path | None, Mesh | None] = (None, None)
    problems = []
    for path in paths:
        try:
            mesh = read_mesh(path)
        except PatinaError as error:
            problems.append(str(error))
            continue
        if best[1] is None or len(mesh.faces) > len(best[1].faces):
            best = path, mesh
    return *best, tuple(problems)


def tool_name(path: Path) -> str:
    """The reconstruction tool that writes such files."""
    if path.is_dir():
        return "COLMAP" if is_colmap(path) else "RealityScan"
    names = {".xml": "Metashape", ".psx": "Metashape", ".psz": "Metashape", ".out": "Bundler"}
    names |= {".nvm": "VisualSFM", ".sfm": "Meshroom", ".csv": "RealityScan"}
    return names.get(path.suffix.lower(), path.name)


def readable_photos(paths: Iterable[Path]) -> tuple[tuple[Path, ...], tuple[str, ...]]:
    """(photos that can be opened, why others cannot)."""
    good, problems = [], []
    for path in paths:
        try:
            image_size(path)
        except PatinaError as error:
            problems.append(str(error))
        else:
            good.append(path)
    return tuple(good), tuple(problems)
