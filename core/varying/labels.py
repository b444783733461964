"""The material that each pixel of a photo shows, and the pixels that are reliable."""

from __future__ import annotations

import zlib
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from ..capture import Capture
from ..errors import InputError
from ..geometry import PixelRays, RayScene, bands, view_window
from ..inputs import capture_data
from ..inputs.material_pixels import material_pixels
from ..inputs.photos import LitPhoto
from ..light import Light
from ..samples.take import halo, inner_pixels, light_surface, trusted_pixels
from ..scan import Camera, Scan

MAX_MATERIALS = 250  # labels are uint8, 0 means no material
COMPRESSION = 1  # level of zlib: 24 megapixels in about 0.1 s


@dataclass(frozen=True)
class PixelLabels:
    """shown: (h, w) uint8, 1 + index of the material that a pixel shows, 0 for none. trusted: the
    same where the pixel is lit, not clipped, and away from outlines, shadow edges and the borders
    of masks; 0 elsewhere. clipped: the same where it is all of that, but clipped."""

    shown: NDArray[np.uint8]
    trusted: NDArray[np.uint8]
    clipped: NDArray[np.uint8]

    def packed(self) -> PackedLabels:
        """The same in a few per cent of the memory."""
        each = (self.shown, self.trusted, self.clipped)
        return PackedLabels(
            self.shown.shape, tuple(zlib.compress(a.tobytes(), COMPRESSION) for a in each)
        )


@dataclass(frozen=True)
class PackedLabels:
    """shape: (h, w); parts: the three arrays of PixelLabels, compressed."""

    shape: tuple[int, ...]
    parts: tuple[bytes, ...]

    def unpacked(self) -> PixelLabels:
        """The labels."""
        arrays = (np.frombuffer(zlib.decompress(part), np.uint8) for part in self.parts)
        return PixelLabels(*(a.reshape(self.shape) for a in arrays))


def check_material_count(capture: Capture) -> None:
    """Raise InputError where a capture has more than MAX_MATERIALS."""
    if len(capture.materials) > MAX_MATERIALS:
        raise InputError(
            f"found {len(capture.materials)} materials; expected at most {MAX_MATERIALS} for "
            "maps and for materials that vary; combine some of them",
            file=capture.file,
        )


def label_pixels(
    capture: Capture,
    scan: Scan,
    rays: RayScene,
    camera: Camera,
    place: int,
    photo: LitPhoto,
    light: Light,
) -> PixelLabels:
    """Label the pixels of photo ``place`` in bands, by the same criteria as the samples of a fit.
    Raises InputError for masks that cannot be used."""
    masks = capture_data.photo_masks(capture, place)
    margins = capture.fit.margins
    lines = PixelRays.of(camera)
    shown = np.zeros(camera.height * camera.width, np.uint8)
    reliable = np.zeros_like(shown)
    usable = photo.usable.ravel()
    for window in bands(camera, halo(margins), rays.cover.columns(camera)):
        view = view_window(rays, lines, window)
        wanted = np.zeros(len(view.pixel), bool)
        wanted[view.wanted] = True
        if not wanted.any():
            continue
        lighting = light_surface(rays, view, light, camera)
        where, in_shadow = material_pixels(capture, scan, view, masks)
        good = trusted_pixels(view, lighting, margins) & ~in_shadow & wanted
        for index, material in enumerate(capture.materials):
            pixels = where[material.name]
            shown[view.pixel[pixels & wanted]] = index + 1
            inner = inner_pixels(view, pixels, margins)
            reliable[view.pixel[good & inner]] = index + 1
    reliable[reliable != shown] = 0  # overlapping masks: the material is ambiguous
    trusted = reliable * usable
    shape = camera.height, camera.width
    return PixelLabels(*(a.reshape(shape) for a in (shown, trusted, reliable - trusted)))
