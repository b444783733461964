"""RealityScan's .xmp files: one beside each photo, of its name.

"RealityCapture XMP Camera Math" (Epic's knowledge base): Rotation is world → camera (x right, y
down, z forward) row by row, Position the camera's centre; image coordinates are in units of the
photo's larger side, from its middle. Each value is an attribute or an element of its own.
"""

from __future__ import annotations

from pathlib import Path
from xml.etree.ElementTree import Element

import numpy as np
from numpy.typing import NDArray

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
MOST_FILES = 50_000
LARGEST = 1 << 20  # bytes of one file
BROWN = ("perspective", "brown3", "brown4", "brown3t2", "brown4t2")


def read_xmp_folder(path: Path, images: Path | None) -> Reconstruction:
    """Cameras of all .xmp files in a folder, or of one file. Raises InputError."""
    files = [path] if path.is_file() else sorted(path.glob("*.xmp"))
    if len(files) > MOST_FILES:
        raise InputError(f"holds {len(files):,} .xmp files, more than {MOST_FILES:,}", file=path)
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
            "no .xmp here holds a pose of RealityScan's (xcr:Rotation and xcr:Position): export "
            "them with 'Metadata (XMP)'",
            file=path,
        )
    notes = []
    if len(found) < len(files):
        notes.append(f"{len(files) - len(found)} .xmp files without a pose were left out")
    return reconstruction_of(cameras, path, notes=tuple(notes))


def _description(file: Path) -> Element | None:
    """The element that holds a camera, or None: photo editors write .xmp files too."""
    try:
        if file.stat().st_size > LARGEST:
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
            f"does not say how large its photo is, and no photo {file.stem!r} is found: give "
            "[scan] images",
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
                f"is {found:g}; only {expected:g} is read (align without a K+ model)",
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
    """k1 … k4, t1, t2. Files spell coefficients with one f."""
    model = (_value(description, "DistortionModel") or "perspective").strip()
    spelled = next(
        (n for n in ("DistortionCoeficients", "DistortionCoefficients")
         if _value(description, n) is not None), "DistortionCoeficients",
    )  # fmt: skip
    numbers = _numbers(description, spelled, 6, file, "0 0 0 0 0 0", fewer=True)
    kind = model.lower()
    if kind == "perspective" or (kind == "division" and not numbers.any()):
        numbers = np.zeros(6)
    elif kind not in BROWN:
        raise InputError(
            f"the lens {model[:40]!r} is not read; expected one of {', '.join(BROWN)}: choose one "
            "of Brown's models in RealityScan and export again",
            file=file,
            key="xcr:DistortionModel",
        )
    return dict(zip(("k1", "k2", "k3", "k4", "t1", "t2"), map(float, numbers), strict=True))


def _numbers(
    element: Element, name: str, count: int, file: Path, default: str | None = None,
    fewer: bool = False,
) -> Array:  # fmt: skip
    """Finite numbers of an attribute or element; the rest 0 where fewer are allowed."""
    text = _value(element, name)
    text = default if text is None else text
    words = (text or "").replace(",", " ").split()
    found = [as_number(word) for word in words[: count + 1]]
    numbers = [number for number in found if number is not None]
    if len(numbers) != len(found) or (len(found) != count and not (fewer and len(found) < count)):
        raise InputError(
            f"is {shown(text)}; expected {count} finite number{'s' * (count > 1)}",
            file=file,
            key=f"xcr:{name}",
            line=line_of(element),
        )
    return np.array(numbers + [0.0] * (count - len(numbers)))
