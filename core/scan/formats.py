"""Choose the reader for a file: each reader module handles one reconstruction tool's format."""

from __future__ import annotations

from collections.abc import Callable
from importlib import import_module
from pathlib import Path

from ..errors import InputError
from .parsing.json_file import read_json
from .readers.colmap import is_colmap, read_colmap
from .reconstruction import Reconstruction

# (path, folder of the photos, chunk) → Reconstruction
Reader = Callable[[Path, Path | None, str | None], Reconstruction]

BY_SUFFIX = {
    ".xml": "metashape",
    ".psx": "metashape_project",
    ".psz": "metashape_project",
    ".out": "bundler",
    ".nvm": "nvm",
    ".sfm": "meshroom",
    ".csv": "realityscan",
    ".xmp": "realityscan",
}
SUPPORTED = (
    "a COLMAP model folder, Metashape .xml, .psx or .psz, Bundler .out, VisualSFM .nvm, Meshroom "
    ".sfm, transforms.json, RealityScan .csv or a folder of .xmp files, OpenMVG sfm_data.json or "
    "OpenSfM reconstruction.json"
)


def read_reconstruction(
    path: Path, images: Path | None = None, chunk: str | None = None
) -> Reconstruction:
    """Cameras, points and frames of any supported model. Raises InputError.

    images: folder of the scan's own photos, for formats that do not hold their sizes. chunk: label
    of the part of a project, where it holds several.
    """
    if path.is_dir():
        return _folder(path, images, chunk)
    if not path.exists():
        raise InputError("no such file", file=path)
    suffix = path.suffix.lower()
    name = _json_format(path) if suffix == ".json" else BY_SUFFIX.get(suffix)
    if name is None:
        raise InputError(
            f"this type of camera file is not supported; expected {SUPPORTED}", file=path
        )
    return _reader(name)(path, images, chunk)


def _reader(name: str) -> Reader:
    """The function read_NAME of the module NAME in readers/."""
    return getattr(import_module(f".readers.{name}", __package__), f"read_{name}")


def _folder(path: Path, images: Path | None, chunk: str | None) -> Reconstruction:
    if chunk is not None:
        raise InputError(
            "a folder has no chunks; expected a Metashape file, or no chunk", file=path
        )
    if is_colmap(path):
        return read_colmap(path)
    if any(path.glob("*.xmp")):
        return _reader("realityscan")(path, images, chunk)
    near = [p for p in (path / "sparse" / "0", path / "sparse", path / "0") if is_colmap(p)]
    hint = f"; use the one in {near[0].relative_to(path)}" if near else ""
    raise InputError(f"the folder holds no COLMAP model (cameras and images){hint}", file=path)


def _json_format(path: Path) -> str:
    """Name of the reader for a .json, from the keys in it."""
    data = read_json(path)
    if isinstance(data, list):
        return "opensfm"
    if isinstance(data, dict):
        for key, name in (
            ("patina_cameras", "patina_cameras"),
            ("frames", "transforms"),
            ("sfm_data_version", "openmvg"),
            ("extrinsics", "openmvg"),
            ("views", "meshroom"),
            ("shots", "opensfm"),
        ):
            if key in data:
                return name
    raise InputError(
        "is not a supported .json; expected transforms.json (key frames), OpenMVG "
        "(sfm_data_version), Meshroom (views) or OpenSfM (shots)",
        file=path,
    )
