"""Metashape's sensors: size, calibration and pose in a rig.

All document versions from 1.2 to 2.x. PhotoScan up to 1.2 writes fx, fy, absolute cx, cy and skew;
later versions write f, offsets cx, cy from the photo's centre, b1, b2. Zero values are omitted.
"""

from __future__ import annotations

from dataclasses import astuple, dataclass
from xml.etree.ElementTree import Element

import numpy as np
from numpy.typing import NDArray

from ...errors import InputError
from ..lenses.metashape_distortion import Calibration
from ..lenses.metashape_lens import colmap_model
from ..parsing.xml_file import line_of
from .metashape_values import Source, flag, number, numbers, properties, size

Array = NDArray[np.float64]

# Metashape's Sensor.Type → lens model (lens.py)
LENSES = {
    "frame": "METASHAPE_FRAME",
    "fisheye": "METASHAPE_FISHEYE",
    "equidistant_fisheye": "METASHAPE_FISHEYE",
    "equisolid_fisheye": "METASHAPE_EQUISOLID",
}
MAX_PARAMETER = 1e12  # of any parameter: the fourth power of larger values overflows


@dataclass(frozen=True)
class Sensor:
    """width, height: pixels of the photos it was calibrated with. model, parameters: as in Camera.
    offset: (4, 4) from its own frame to that of the rig's master; None where the file holds none.
    notes: assumptions made."""

    label: str
    width: int
    height: int
    model: str
    parameters: tuple[float, ...]
    offset: Array | None
    notes: tuple[str, ...] = ()


def read_sensor(element: Element, file: Source) -> Sensor:
    """One <sensor>. Raises InputError for an unsupported type or a missing calibration."""
    label = element.get("label") or f"sensor {element.get('id')}"
    sensor_properties = properties(element)
    if flag(sensor_properties.get("film_camera"), False) or element.find("film_camera") is not None:
        raise _unsupported(
            element,
            file,
            f"{label!r} is a film camera (scans with fiducial marks), which is not supported",
        )
    calibration = _calibration(element)
    kind = element.get("type") or "frame"
    if calibration is not None:
        kind = calibration.get("type") or kind
    resolution = size(element.find("resolution"), file)
    if calibration is not None:
        resolution = size(calibration.find("resolution"), file) or resolution
    if resolution is None:
        raise InputError(f"{label!r} has no resolution", file=file, line=line_of(element))
    offset = _offset(element, file)
    width, height = resolution
    if kind == "spherical":
        if width != 2 * height:
            raise _unsupported(
                element, file, f"{label!r} is a panorama of {width} × {height} pixels"
            )
        return Sensor(label, width, height, "EQUIRECTANGULAR", (width, height), offset)
    if kind not in LENSES:
        raise _unsupported(element, file, f"{label!r} has the type {kind!r}")
    if calibration is None:
        raise InputError(
            f"{label!r} has no calibration with a focal length; expected one that Align Photos "
            "has adjusted",
            file=file,
            line=line_of(element),
        )
    lens = _parameters(calibration, width, height, file)
    model, parameters = colmap_model(LENSES[kind], lens)
    notes = tuple(_calibration_notes(calibration, label))
    return Sensor(label, width, height, model, parameters, offset, notes)


def _unsupported(element: Element, file: Source, what: str) -> InputError:
    return InputError(
        f"{what}; expected frame, fisheye (equidistant or equisolid), or spherical twice as wide "
        "as high",
        file=file,
        line=line_of(element),
    )


def _calibration(sensor: Element) -> Element | None:
    """The adjusted calibration, else the initial one, else any. A calibration without a focal
    length is returned only for sensors that need none."""
    found = sensor.findall("calibration")
    with_focal = [c for c in found if c.find("f") is not None or c.find("fx") is not None]
    order = {"adjusted": 0, "initial": 2}
    wanted = with_focal
    if not wanted and sensor.get("type") not in LENSES:
        wanted = found
    return min(wanted, key=lambda c: order.get(c.get("class", ""), 1), default=None)


def _parameters(calibration: Element, width: int, height: int, file: Source) -> Calibration:
    """Metashape's parameters with an absolute principal point. Raises InputError."""
    value = {
        name: number(calibration, name, file)
        for name in ("k1", "k2", "k3", "k4", "p1", "p2", "p3", "p4")
    }
    cx, cy = (number(calibration, name, file, np.nan) for name in ("cx", "cy"))
    if calibration.find("f") is None:  # PhotoScan: fx, fy, absolute cx, cy
        fx, fy = (number(calibration, name, file, np.nan) for name in ("fx", "fy"))
        f = fx if np.isnan(fy) else fy
        b1 = 0.0 if np.isnan(fx) else fx - f
        b2 = number(calibration, "skew", file)
        cx, cy = (width / 2 if np.isnan(cx) else cx), (height / 2 if np.isnan(cy) else cy)
    else:
        f = number(calibration, "f", file)
        b1, b2 = number(calibration, "b1", file), number(calibration, "b2", file)
        cx, cy = np.nan_to_num(cx) + width / 2, np.nan_to_num(cy) + height / 2
    lens = Calibration(f, float(cx), float(cy), **value, b1=b1, b2=b2)
    if not min(f, f + b1) > 1e-6:
        raise InputError(
            f"a focal length of {min(f, f + b1):g} pixels; expected a positive one",
            file=file,
            line=line_of(calibration),
        )
    if max(abs(p) for p in astuple(lens)) > MAX_PARAMETER:
        raise InputError(
            "a calibration parameter above 1e12; expected pixels and factors",
            file=file,
            line=line_of(calibration),
        )
    return lens


def _calibration_notes(calibration: Element, label: str) -> list[str]:
    """Sentences about the calibration that a user should read."""
    found = []
    if calibration.get("class") == "initial":
        found.append(
            f"The sensor {label!r} has only an initial calibration, which was not adjusted."
        )
    if any("correction" in child.tag for child in calibration):
        found.append(f"The additional corrections of the sensor {label!r} were not read.")
    return found


def _offset(sensor: Element, file: Source) -> Array | None:
    """(4, 4) from the sensor's frame to its master's: x_master = rotation · x + location."""
    matrix = sensor.find("transform")
    rotation, location = sensor.find("rotation"), sensor.find("location")
    if matrix is not None and (matrix.text or "").strip():
        return numbers(matrix, 16, file).reshape(4, 4)
    if rotation is None and location is None:
        return None
    offset = np.eye(4)
    if rotation is not None:
        offset[:3, :3] = numbers(rotation, 9, file).reshape(3, 3)
    if location is not None:
        offset[:3, 3] = numbers(location, 3, file)
    return offset
