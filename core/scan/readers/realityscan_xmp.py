"""Reader for RealityScan's .xmp files: one per photo, with the photo's name.

"RealityCapture XMP Camera Math" (Epic's knowledge base): Rotation is world → camera (x right, y
down, z forward) row by row; Position is the camera's centre. Image coordinates are relative to the
photo's centre, in units of its larger side. Each value is an attribute or a child element.
"""

from __future__ import annotations

from pathlib import Path
from xml.etree.ElementTree import Element

import numpy as np
from numpy.typing import NDArray

from ...counted import counted
from ...errors import InputError
from ..camera import Camera, Pose
from ..parsing.json_record import as_number, shown
from ..parsing.photo_labels import labels_of
from ..parsing.photo_sizes import PhotoSizes
from ..parsing.xml_file import line_of, read_xml
from ..reconstruction import Reconstruction, reconstruction_of
from .realityscan_lens import normalised_lens

Array = NDArray[np.float64]

NAMESPACE = "{http://www.capturingreality.com/ns/xcr/1.1#}"
DESCRIPTION = "{http://www.w3.org/1999/02/22-rdf-syntax-ns#}Description"
MAX_FILES = 50_000  # in a folder
MAX_FILE_BYTES = 1 << 20  # bytes of one file
BROWN = ("perspective", "brown3", "brown4", "brown3t2", "brown4t2")


def read_xmp_folder(path: Path, images: Path | None) -> Reconstruction:
    """Cameras of all .xmp files in a folder, or of one file. Raises InputError."""
    files = [path] if path.is_file() else sorted(path.glob("*.xmp"))
    if len(files) > MAX_FILES:
        raise InputError(
            f"holds {len(files):,} .xmp files; expected at most {MAX_FILES:,}", file=path
        )
    read = [(file, _description(file)) for file in files]
    found = [(file, description) for file, description in read if description is not None]
    photos = PhotoSizes(images, path if path.is_dir() else path.parent)
    labels = labels_of([file.stem for file, _ in found], path)
    cameras = [
        _camera(label, file, description, photos)
        for label, (file, description) in zip(labels, found, strict=True)
    ]
    if not cameras:
        raise InputError(
            "found no .xmp with a RealityScan pose (xcr:Rotation and xcr:Position); export "
            "them with 'Metadata (XMP)'",
            file=path,
        )
    notes = []
    if len(found) < len(files):
        notes.append(f".xmp files without a pose that were left out: {len(files) - len(found)}.")
    return reconstruction_of(cameras, path, notes=tuple(notes))


def _description(file: Path) -> Element | None:
    """The element that holds a camera; None where there is none (photo editors write .xmp files
    too)."""
    try:
        if file.stat().st_size > MAX_FILE_BYTES:
            return None
    except OSError as error:
        raise InputError(f"cannot be read ({error.strerror})", file=file) from error
    for element in read_xml(file).iter(DESCRIPTION):
        if _value(element, "Rotation") is not None and _value(element, "Position") is not None:
            return element
    return None


def _value(element: Element, name: str) -> str | None:
    attribute = element.get(NAMESPACE + name)
    return attribute if attribute is not None else element.findtext(NAMESPACE + name)


def _camera(label: str, file: Path, description: Element, photos: PhotoSizes) -> Camera:
    size = photos.size(file.stem)
    if size is None:
        raise InputError(
            f"does not hold the size of its photo, and no photo {file.stem!r} was found; set "
            "[scan] images to the folder of the photos",
            file=file,
        )
    rotation = _numbers(description, "Rotation", 9, file).reshape(3, 3)
    centre = _numbers(description, "Position", 3, file)
    values = {"f": float(_numbers(description, "FocalLength35mm", 1, file)[0])}
    for key, name in (("px", "PrincipalPointU"), ("py", "PrincipalPointV")):
        values[key] = float(_numbers(description, name, 1, file, "0")[0])
    for name, expected in (("Skew", 0.0), ("AspectRatio", 1.0)):
        found = float(_numbers(description, name, 1, file, str(expected))[0])
        if found != expected:
            raise InputError(
                f"is {found:g}; expected {expected:g}; align the photos without a K+ model",
                file=file,
                key=f"xcr:{name}",
            )
    values |= _distortion(description, file)
    photo = photos.find(file.stem)
    return Camera(
        label, *size, *normalised_lens(values, size), Pose(rotation, -rotation @ centre),
        photo.name if photo is not None else file.stem,
    )  # fmt: skip


def _distortion(description: Element, file: Path) -> dict[str, float]:
    """k1 … k4, t1, t2. RealityScan spells the key "Coeficients"."""
    model = (_value(description, "DistortionModel") or "perspective").strip()
    spelled = next(
        (n for n in ("DistortionCoeficients", "DistortionCoefficients")
         if _value(description, n) is not None), "DistortionCoeficients",
    )  # fmt: skip
    values = _numbers(description, spelled, 6, file, "0 0 0 0 0 0", fewer=True)
    kind = model.lower()
    if kind == "perspective" or (kind == "division" and not values.any()):
        values = np.zeros(6)
    elif kind not in BROWN:
        raise InputError(
            f"the lens {model[:40]!r} is not supported; expected one of {', '.join(BROWN)}; "
            "choose one "
            "of Brown's models in RealityScan and export again",
            file=file,
            key="xcr:DistortionModel",
        )
    return dict(zip(("k1", "k2", "k3", "k4", "t1", "t2"), map(float, values), strict=True))


def _numbers(
    element: Element, name: str, count: int, file: Path, default: str | None = None,
    fewer: bool = False,
) -> Array:  # fmt: skip
    """(count,) finite numbers of an attribute or element; missing ones are 0 where ``fewer`` is
    set."""
    text = _value(element, name)
    text = default if text is None else text
    words = (text or "").replace(",", " ").split()
    found = [as_number(word) for word in words[: count + 1]]
    values = [number for number in found if number is not None]
    if len(values) != len(found) or (len(found) != count and not (fewer and len(found) < count)):
        raise InputError(
            f"is {shown(text)}; expected {counted(count, 'finite number')}",
            file=file,
            key=f"xcr:{name}",
            line=line_of(element),
        )
    return np.array(values + [0.0] * (count - len(values)))
