"""The readers that `run.py fuzz` attacks, with files to start from: those of the demo, and those of
the reference data where they are there."""

from __future__ import annotations

import hashlib
import io
import json
import os
import shutil
import struct
import sys
import tempfile
import zipfile
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from .common import ROOT, cache_dir, quietly

MAX_SEED_BYTES = 40_000  # large files are slow
MAX_LIST = 6  # entries of a list of which a seed has all
DEMO = ROOT / "assets" / "demo"
DATA = Path(os.environ.get("PATINA_SHARED", ROOT.parent / "shared")) / "data" / "cameras"


@dataclass(frozen=True)
class Target:
    """A reader. file: name of the file that it gets; read: called with its path; seeds: contents to
    start from; others: (name, content) of files that must be beside it."""

    name: str
    file: str
    read: Callable[[Path], object]
    seeds: tuple[bytes, ...]
    others: tuple[tuple[str, bytes], ...] = ()


def targets() -> dict[str, Target]:
    """Name → target."""
    from patina.core.batch.collection import read_collection
    from patina.core.brdf import merl_file
    from patina.core.capture import read_capture
    from patina.core.photo import read_encoded
    from patina.core.photo.exif import read_exif
    from patina.core.photo.image import read_mask
    from patina.core.result import read_result
    from patina.core.scan.formats import read_reconstruction
    from patina.core.scan.mesh import read_mesh

    def folder(path: Path) -> object:
        return read_reconstruction(path.parent)

    def result(path: Path) -> object:
        return read_result(path.parent)

    cameras = {
        "metashape": ("cameras.xml", "metashape/*.xml"),
        "bundler": ("bundle.out", "bundler/*.out"),
        "meshroom": ("model.sfm", "meshroom/*.sfm"),
        "openmvg": ("sfm_data.json", "openmvg/*.json"),
        "opensfm": ("reconstruction.json", "opensfm/*.json"),
        "transforms": ("transforms.json", "transforms_json/*.json"),
    }
    found = [
        Target(name, file, read_reconstruction, _seeds(DATA, pattern))
        for name, (file, pattern) in cameras.items()
    ]
    texts = dict(_model(DATA / "colmap" / "own_brighton_OPENCV_txt", ".txt"))
    binaries = dict(_model(DATA / "colmap" / "own_brighton_OPENCV_bin", ".bin"))
    for model in (texts, binaries):
        for name, content in list(model.items())[:2]:
            others = tuple((n, c) for n, c in model.items() if n != name)
            found.append(Target(f"colmap {name}", name, folder, (content,), others))
    found += [
        Target("nvm", "model.nvm", read_reconstruction, (NVM,)),
        Target("realityscan", "cameras.csv", read_reconstruction, (REALITYSCAN,)),
        Target("metashape project", "a.psz", read_reconstruction, (_project(),)),
        Target("capture", "demo.capture.toml", read_capture, _seeds(DEMO, "*.toml"), _demo_files()),
        Target("collection", "all.csv", read_collection, (b"capture,name\na.toml,b\n",)),
        Target("ply", "mesh.ply", read_mesh, (PLY, *_seeds(DEMO, "mesh.ply"))),
        Target("obj", "mesh.obj", read_mesh, (OBJ,)),
        Target("stl", "mesh.stl", read_mesh, (_stl(),)),
        Target("glb", "mesh.glb", read_mesh, (_glb(),)),
        Target("result", "result.json", result, (_result(),)),
        Target("merl", "a.binary", merl_file.read, (struct.pack("<3i", 90, 90, 180),)),
        *(
            Target(f"{kind} {way}", f"a.{kind}", read, (_picture(kind),))
            for kind in ("png", "tif", "jpg", "exr")
            for way, read in (("photo", read_encoded), ("exif", read_exif), ("mask", read_mask))
            if way != "mask" or kind == "png"
        ),
    ]  # fmt: skip
    return {one.name: one for one in found if one.seeds}


PLY = b"""ply
format ascii 1.0
element vertex 3
property float x
property float y
property float z
property uchar red
element face 1
property list uchar int vertex_indices
end_header
0 0 0 1
1 0 0 2
0 1 0 3
3 0 1 2
"""
NVM = b"NVM_V3\n\n2\na.jpg 900 1 0 0 0 0 0 0 0 0\nb.jpg 900 1 0 0 0 1 0 0 0.1 0\n\n0\n"
OBJ = b"mtllib a.mtl\nv 0 0 0\nv 1 0 0\nv 0 1 0\nvt 0 0\nvn 0 0 1\nusemtl a\nf 1/1/1 2/1/1 -1/1/1\n"
REALITYSCAN = (
    b"#name,x,y,alt,heading,pitch,roll,f,px,py,k1,k2,k3,k4,t1,t2\n"
    b"a.jpg,0,0,1,0,0,0,35,0,0,0,0,0,0,0,0\n"
)


def _result() -> bytes:
    """The result of a fit, which the first call computes (20 s)."""
    writer = hashlib.sha256((ROOT / "core" / "report" / "result_json.py").read_bytes()).hexdigest()
    kept = cache_dir() / "fuzz" / f"result-{writer[:10]}.json"
    if not kept.is_file():
        from .bench_speed_scene import make_capture

        with tempfile.TemporaryDirectory() as name:
            capture = make_capture(Path(name) / "capture", 0.02, 2000, 3)
            command = [sys.executable, ROOT / "headless.py", "fit", capture, "--out", f"{name}/out"]
            quietly(command, "fitting a capture")
            kept.parent.mkdir(parents=True, exist_ok=True)
            partial = kept.with_suffix(f".{os.getpid()}.part")
            shutil.copy(Path(name) / "out" / "result.json", partial)
            partial.replace(kept)
    return kept.read_bytes()


def _seeds(folder: Path, pattern: str) -> tuple[bytes, ...]:
    """The files of a pattern, shortened where they are large, so that they are still valid."""
    found = []
    for file in sorted(folder.glob(pattern)):
        content = file.read_bytes()
        if file.suffix in (".json", ".sfm"):
            content = json.dumps(_shortened(json.loads(content))).encode()
        if len(content) <= MAX_SEED_BYTES:
            found.append(content)
    return tuple(found)


def _shortened(value: Any) -> Any:
    """A value of JSON whose long lists and objects of objects have two entries."""
    if isinstance(value, list):
        kept = value[:2] if len(value) > MAX_LIST else value
        return [_shortened(one) for one in kept]
    if isinstance(value, dict):
        items = list(value.items())
        alike = len(items) > MAX_LIST and all(isinstance(v, dict) for v in value.values())
        return {key: _shortened(one) for key, one in (items[:2] if alike else items)}
    return value


def _model(folder: Path, suffix: str) -> list[tuple[str, bytes]]:
    """Cameras and two images of a COLMAP model, without points."""
    if not (folder / f"cameras{suffix}").is_file():
        return []
    cameras, images = ((folder / f"{n}{suffix}").read_bytes() for n in ("cameras", "images"))
    if suffix == ".txt":
        lines = [line for line in images.splitlines() if not line.startswith(b"#")][::2][:2]
        images, points = b"".join(line + b"\n\n" for line in lines), b""
    else:
        name_end = images.index(b"\0", 8 + 64) + 1
        images = struct.pack("<Q", 1) + images[8:name_end] + struct.pack("<Q", 0)
        points = struct.pack("<Q", 0)
    return [
        (f"cameras{suffix}", cameras), (f"images{suffix}", images), (f"points3D{suffix}", points),
    ]  # fmt: skip


def _demo_files() -> tuple[tuple[str, bytes], ...]:
    """The files that the demo's capture names, empty: only their paths are checked."""
    return tuple(
        (file.relative_to(DEMO).as_posix(), b"")
        for file in sorted(DEMO.rglob("*"))
        if file.is_file() and file.suffix != ".toml"
    )


def _project() -> bytes:
    """A project of Metashape without cameras."""
    made = io.BytesIO()
    with zipfile.ZipFile(made, "w") as archive:
        archive.writestr(
            "doc.xml", '<document version="1.2.0"><chunks><chunk/></chunks></document>'
        )
    return made.getvalue()


def _stl() -> bytes:
    return b"\0" * 80 + struct.pack("<I12fH", 1, 0, 0, 1, 0, 0, 0, 1, 0, 0, 0, 1, 0, 0)


def _glb() -> bytes:
    """A triangle."""
    points = np.array([[0, 0, 0], [1, 0, 0], [0, 1, 0]], "<f4").tobytes()
    head = (
        b'{"asset":{"version":"2.0"},"scene":0,"scenes":[{"nodes":[0]}],"nodes":[{"mesh":0}],'
        b'"meshes":[{"primitives":[{"attributes":{"POSITION":0}}]}],"buffers":[{"byteLength":36}],'
        b'"bufferViews":[{"buffer":0,"byteLength":36}],"accessors":[{"bufferView":0,'
        b'"componentType":5126,"count":3,"type":"VEC3","min":[0,0,0],"max":[1,1,0]}]}'
    )
    head += b" " * (-len(head) % 4)
    body = struct.pack("<II", len(head), 0x4E4F534A) + head
    body += struct.pack("<II", len(points), 0x004E4942) + points
    return struct.pack("<4sII", b"glTF", 2, 12 + len(body)) + body


def _picture(kind: str) -> bytes:
    """A small picture."""
    import OpenImageIO as oiio

    pixels = np.random.default_rng(0).random((8, 8, 3)).astype(np.float32)
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / f"a.{kind}"
        image = oiio.ImageBuf(oiio.ImageSpec(8, 8, 3, "half" if kind == "exr" else "uint8"))
        image.set_pixels(oiio.ROI(), pixels)
        image.specmod().attribute("Exif:ExposureTime", 0.01)
        image.write(str(path))
        return path.read_bytes()
