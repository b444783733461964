"""A drawing as pixels: antialiased by the covered fraction of each pixel. Text by OpenImageIO."""

from __future__ import annotations

import re

import numpy as np
import OpenImageIO as oiio
from numpy.typing import NDArray

from .drawing import Area, Dots, Drawing, Label, Line, Picture, rgb

Array = NDArray[np.float32]

PAPER = "#f7f8fa"
FINE = 3  # subpixels along each side of a pixel, for the coverage of polygons
DISC_STEP = 0.35  # pixels between the discs that a line is made of
FACE, GREEK_FACE = "DroidSans", "DroidSansMono"  # ship with OpenImageIO; the first has no Greek
GREEK = re.compile("([\u0370-\u03ff]+)")


def raster(drawing: Drawing, scale: float = 2.0) -> NDArray[np.uint8]:
    """(h, w, 3) sRGB pixels; scale: pixels per unit of the drawing."""
    height, width = round(drawing.height * scale), round(drawing.width * scale)
    image = np.empty((height, width, 3), np.float32)
    image[:] = _rgb(PAPER)
    for part in drawing.parts:
        if isinstance(part, Area):
            _area(image, part, scale)
        elif isinstance(part, Line):
            _line(image, part, scale)
        elif isinstance(part, Dots):
            _dots(image, part, scale)
        elif isinstance(part, Picture):
            _picture(image, part, scale)
    labels = [part for part in drawing.parts if isinstance(part, Label)]
    return _written(image, labels, scale)


def inside(corners: NDArray[np.floating], height: int, width: int) -> Array:
    """(height, width) fraction 0 … 1 of each pixel inside a closed outline (n, 2), by the even-odd
    rule."""
    rows, columns = height * FINE, width * FINE
    start = np.asarray(corners, np.float64) * FINE
    end = np.roll(start, -1, axis=0)
    top = np.ceil(np.minimum(start[:, 1], end[:, 1]) - 0.5).astype(int)
    bottom = np.ceil(np.maximum(start[:, 1], end[:, 1]) - 0.5).astype(int)
    top, bottom = np.clip(top, 0, rows), np.clip(bottom, 0, rows)
    count = bottom - top
    edge = np.repeat(np.arange(len(start)), count)
    row = np.arange(count.sum()) - np.repeat(np.cumsum(count) - count, count) + top[edge]
    along = (row + 0.5 - start[edge, 1]) / (end[edge, 1] - start[edge, 1])
    x = start[edge, 0] + along * (end[edge, 0] - start[edge, 0])
    column = np.clip(np.ceil(x - 0.5), 0, columns).astype(int)
    crossed = np.bincount(row * (columns + 1) + column, minlength=rows * (columns + 1))
    odd = (crossed & 1).astype(np.uint8).reshape(rows, columns + 1)[:, :-1]
    within = np.bitwise_xor.accumulate(odd, axis=1)
    fine = within.reshape(height, FINE, width, FINE)
    return np.add.reduce(fine, axis=(1, 3), dtype=np.float32) / FINE**2


def _area(image: Array, part: Area, scale: float) -> None:
    """Fill a polygon; only its bounding box is computed."""
    corners = part.points * scale
    left, top = np.maximum(np.floor(corners.min(axis=0)).astype(int), 0)
    right, bottom = np.ceil(corners.max(axis=0)).astype(int) + 1
    target = image[top:bottom, left:right]
    covered = inside(corners - (left, top), *target.shape[:2])
    _over(target, part.opacity * covered, _rgb(part.colour))


def _line(image: Array, part: Line, scale: float) -> None:
    """Draw a line as closely spaced discs; a dashed line omits those in its gaps."""
    points = part.points * scale
    if len(points) < 2:
        return
    length = np.concatenate([[0.0], np.cumsum(np.hypot(*np.diff(points, axis=0).T))])
    at = np.arange(0.0, length[-1] + DISC_STEP, DISC_STEP)
    if part.dash is not None:
        at = at[np.mod(at, sum(part.dash) * scale) < part.dash[0] * scale]
    places = np.stack([np.interp(at, length, points[:, k]) for k in (0, 1)], axis=1)
    rows, columns, part_of, _ = _discs(places, part.width * scale / 2, image.shape)
    if not len(rows):
        return
    top, left = rows.min(), columns.min()
    target = image[top : rows.max() + 1, left : columns.max() + 1]
    covered = np.zeros(target.shape[:2], np.float32)
    np.maximum.at(covered, (rows - top, columns - left), part_of.astype(np.float32))
    _over(target, covered, _rgb(part.colour))


def _dots(image: Array, part: Dots, scale: float) -> None:
    """Blend discs: the transmittances of all discs at a pixel multiply, and their colours are
    averaged by opacity."""
    if not len(part.points):
        return
    rows, columns, part_of, which = _discs(part.points * scale, part.radius * scale, image.shape)
    place = rows * image.shape[1] + columns
    size = image.shape[0] * image.shape[1]
    opaque = np.minimum(part.opacity * part_of, 0.999)
    through = np.exp(np.bincount(place, np.log1p(-opaque), size))
    weight = np.maximum(np.bincount(place, opaque, size), 1e-12)
    flat = image.reshape(-1, 3)
    for channel in range(3):
        shade = part.colours[which, channel] / 255.0
        mean = np.bincount(place, opaque * shade, size) / weight
        flat[:, channel] = through * flat[:, channel] + (1 - through) * mean


def _discs(
    places: NDArray[np.floating], radius: float, shape: tuple[int, ...]
) -> tuple[NDArray[np.intp], NDArray[np.intp], NDArray[np.float64], NDArray[np.intp]]:
    """(rows, columns, covered fractions, indices of the discs) of all pixels that discs touch."""
    reach = int(np.ceil(radius + 0.5))
    steps = np.arange(-reach, reach + 1)
    corner = np.floor(places).astype(int)
    columns = corner[:, 0, None, None] + steps[None, None, :]
    rows = corner[:, 1, None, None] + steps[None, :, None]
    far = np.hypot(columns + 0.5 - places[:, 0, None, None], rows + 0.5 - places[:, 1, None, None])
    covered = np.clip(radius + 0.5 - far, 0.0, 1.0)
    rows, columns = np.broadcast_to(rows, far.shape), np.broadcast_to(columns, far.shape)
    which = np.broadcast_to(np.arange(len(places))[:, None, None], far.shape)
    seen = (covered > 0) & (rows >= 0) & (rows < shape[0]) & (columns >= 0) & (columns < shape[1])
    return rows[seen], columns[seen], covered[seen], which[seen]


def _picture(image: Array, part: Picture, scale: float) -> None:
    """Draw an image, resampled to the nearest pixel."""
    left, top = round(part.left * scale), round(part.top * scale)
    width, height = round(part.width * scale), round(part.height * scale)
    rows = (np.arange(height) + 0.5) * part.pixels.shape[0] / height
    columns = (np.arange(width) + 0.5) * part.pixels.shape[1] / width
    shown = part.pixels[rows.astype(int)[:, None], columns.astype(int)[None, :], :3]
    target = image[top : top + height, left : left + width]
    target[:] = shown[: target.shape[0], : target.shape[1]] / np.float32(255)


def _written(image: Array, labels: list[Label], scale: float) -> NDArray[np.uint8]:
    """(h, w, 3) uint8 the image with its labels drawn over it."""
    height, width, _ = image.shape
    buffer = oiio.ImageBuf(oiio.ImageSpec(width, height, 4, "float"))
    opaque = np.concatenate([image, np.ones((height, width, 1), np.float32)], axis=2)
    buffer.set_pixels(oiio.ROI(0, width, 0, height), np.ascontiguousarray(opaque))
    for one in labels:
        size, colour = round(one.size * scale), (*_rgb(one.colour).tolist(), 1.0)
        runs = [(text, GREEK_FACE if GREEK.match(text) else FACE) for text in GREEK.split(one.text)]
        wide = [_advance(text, face, size) for text, face in runs]
        left = one.x * scale - sum(wide) * {"start": 0.0, "middle": 0.5, "end": 1.0}[one.anchor]
        for (text, face), own in zip(runs, wide, strict=True):
            oiio.ImageBufAlgo.render_text(
                buffer, round(left), round(one.y * scale), text, size, face, colour
            )
            left += own
    pixels = np.asarray(buffer.get_pixels(oiio.FLOAT))[..., :3]
    return (np.clip(pixels, 0, 1) * 255 + 0.5).astype(np.uint8)


def _advance(text: str, face: str, size: int) -> float:
    """Advance width of a text in pixels, spaces included."""
    both, ends = (oiio.ImageBufAlgo.text_size(t, size, face) for t in (f"|{text}|", "||"))
    return float(both.width - ends.width)


def _over(image: Array, covered: Array, colour: Array) -> None:
    """Blend a colour (3,) over the image in place; covered: (h, w) opacity."""
    image += covered[..., None] * (colour - image)


def _rgb(colour: str) -> Array:
    return rgb(colour).astype(np.float32) / 255
