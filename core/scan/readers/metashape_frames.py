"""Metashape's frames: the chunk's frame, and the world's frame, which is geocentric (Earth-centred,
metres) for a georeferenced chunk."""

from __future__ import annotations

from xml.etree.ElementTree import Element

import numpy as np
from numpy.typing import NDArray

from ...errors import InputError
from ..parsing.xml_file import line_of
from ..reconstruction import Georeference, Similarity
from .metashape_values import Source, numbers

Array = NDArray[np.float64]

# WGS84 ellipsoid (NIMA TR8350.2): metres, and the first eccentricity squared
SEMI_MAJOR = 6378137.0
ECCENTRICITY_2 = 6.694379990141316e-3
MAX_ALTITUDE = 1e5  # metres from the ellipsoid; larger values are not a place on Earth
SAME_DATUM = ("WGS 84", "WGS84", "World Geodetic System 1984", "EPSG::4326")


def read_transform(parent: Element, file: Source) -> Similarity | None:
    """The <transform> of a chunk or component to the world's frame: rotation, translation and
    scale, each omitted where it is the identity, or a 4 × 4 matrix. Raises InputError."""
    element = parent.find("transform")
    if element is None:
        return None
    if (element.text or "").strip():
        matrix = numbers(element, 16, file).reshape(4, 4)
    elif len(element):
        matrix = np.eye(4)
        rotation, translation = element.find("rotation"), element.find("translation")
        scale = element.find("scale")
        if rotation is not None:
            matrix[:3, :3] = numbers(rotation, 9, file).reshape(3, 3)
        if scale is not None:
            matrix[:3, :3] *= numbers(scale, 1, file)[0]
        if translation is not None:
            matrix[:3, 3] = numbers(translation, 3, file)
    else:
        return None
    try:
        with np.errstate(over="ignore", invalid="ignore"):
            return Similarity.of_matrix(matrix)
    except ValueError as error:
        raise InputError(
            f"the <transform> of this {parent.tag} is not a similarity (rotation, scale, "
            f"translation): {error}",
            file=file,
            line=line_of(element),
        ) from error


def between(source: Similarity, target: Similarity) -> Similarity:
    """Transform from one frame to another, each given by its transform to the world's frame."""
    scale = source.scale / target.scale
    rotation = target.rotation.T @ source.rotation
    translation = target.rotation.T @ (source.translation - target.translation) / target.scale
    return Similarity(rotation, translation, scale)


def read_georeference(
    chunk: Element, world: Similarity | None, centre: Array
) -> tuple[Georeference | None, tuple[str, ...]]:
    """(georeference at ``centre`` (3,) in the cameras' frame, notes). The chunk's coordinate system
    decides: with any system that is tied to the Earth the world's frame is geocentric."""
    system = (chunk.findtext("reference") or "").strip()
    if not system or system.startswith("LOCAL_CS") or world is None:
        return None, ()
    name = system.split('"')[1] if system.count('"') > 1 else system[:40]
    place = world.points(centre[None])[0]
    latitude, longitude, altitude = geodetic(place)
    if abs(altitude) > MAX_ALTITUDE:
        return None, (
            f"The chunk's coordinate system is {name!r}, but its transform does not lead to the "
            "Earth's surface. The location of the scan is unknown.",
        )
    axes = [world.rotation.T @ axis for axis in east_north_up(latitude, longitude)]
    notes: tuple[str, ...] = ()
    if not any(known in system for known in SAME_DATUM):
        notes = (f"Latitude and longitude are treated as WGS84; the scan uses {name!r}.",)
    degrees = float(np.degrees(latitude)), float(np.degrees(longitude))
    return Georeference(*degrees, altitude, *axes), notes


def geodetic(place: Array) -> tuple[float, float, float]:
    """(latitude, longitude in radians, altitude in metres) of a geocentric point (3,), metres.

    Bowring's iteration (Survey Review 23, 1976); it converges in three steps near the ground.
    """
    x, y, z = (float(value) for value in place)
    across = float(np.hypot(x, y))
    latitude = float(np.arctan2(z, across * (1 - ECCENTRICITY_2)))
    for _ in range(10):
        sine = np.sin(latitude)
        normal = SEMI_MAJOR / np.sqrt(1 - ECCENTRICITY_2 * sine**2)
        latitude = float(np.arctan2(z + ECCENTRICITY_2 * normal * sine, across))
    sine = np.sin(latitude)
    altitude = (
        across * np.cos(latitude) + z * sine - SEMI_MAJOR * np.sqrt(1 - ECCENTRICITY_2 * sine**2)
    )
    return latitude, float(np.arctan2(y, x)), float(altitude)


def east_north_up(latitude: float, longitude: float) -> tuple[Array, Array, Array]:
    """Unit vectors (3,) in the geocentric frame at a latitude and longitude in radians."""
    sine, cosine = np.sin(latitude), np.cos(latitude)
    east = np.array([-np.sin(longitude), np.cos(longitude), 0.0])
    up = np.array([cosine * np.cos(longitude), cosine * np.sin(longitude), sine])
    return east, np.cross(up, east), up
