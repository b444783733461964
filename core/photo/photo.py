"""Read a photo as linear light, with masks of clipped and black pixels."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

import numpy as np
import OpenImageIO as oiio
from numpy.typing import NDArray

from ..errors import InputError
from .clipping import black, clipped
from .container import KIND_OF, RAW, READABLE_SUFFIXES
from .declared import ASSUMED, Declared, declared
from .image import OpenImage, open_image
from .raw import DEMOSAIC, develop
from .transfer import Transfer

AUTO = Transfer.named("auto")
ROWS = 256


@dataclass(frozen=True)
class PhotoInfo:
    """How a photo was read.

    kind: 'jpeg', 'tiff', 'png', 'openexr', 'hdr' or 'raw'; transfer: the curve used; reason: why,
    in a sentence; levels: number of codes of an integer format (256, 65536), None for floats;
    saturation: largest linear pixel value of the file, None where unknown; white_balance:
    multipliers applied to a RAW's R, G, B; notes: sentences for the user; mixed: whether a matrix
    of primaries mixed the channels.
    """

    kind: str
    transfer: Transfer
    reason: str
    levels: int | None = None
    saturation: float | None = None
    white_balance: tuple[float, float, float] | None = None
    notes: tuple[str, ...] = ()
    mixed: bool = False

    @property
    def sentence(self) -> str:
        """One line for a report: the curve and why."""
        return f"{self.kind}, curve {self.transfer.name}: {self.reason}."


@dataclass(frozen=True)
class Photo:
    """A photo as linear light.

    radiance: (h, w, 3) float32 linear, not divided by an exposure; Rec.709 primaries where the file
    declares its own. clipped: (h, w) at or near saturation in a channel; black: (h, w) at or below
    0 in a channel. Rows from the top, columns from the left, in the sensor's orientation.
    """

    radiance: NDArray[np.float32]
    clipped: NDArray[np.bool_]
    black: NDArray[np.bool_]
    info: PhotoInfo


def read_radiance(path: Path, transfer: Transfer | str = AUTO) -> NDArray[np.float32]:
    """(h, w, 3) linear radiance in the photo's own units. Raises InputError. See read_photo."""
    return read_photo(path, transfer).radiance


def read_photo(
    path: Path, transfer: Transfer | str = AUTO, saturation: float | None = None
) -> Photo:
    """Read EXR, TIFF, PNG, JPEG, Radiance .hdr or camera RAW as linear light.

    transfer: replaces the file's curve (not its primaries). saturation: the linear pixel value at
    which a floating-point photo clips, if known. The EXIF orientation is never applied. A grey
    image (Y) is repeated into three channels; alpha, depth and other parts are ignored. Raises
    InputError for another format, a damaged file, or pixels that are NaN or infinite.
    """
    if isinstance(transfer, str):
        transfer = Transfer.named(transfer)
    suffix = path.suffix.lower()
    if suffix in RAW:
        return _raw(path, transfer)
    if suffix not in KIND_OF:
        raise InputError(
            f"has the unknown suffix {suffix!r}; expected {READABLE_SUFFIXES}", file=path
        )
    with open_image(path) as image:
        return _decode(image, transfer, saturation)


def _decode(image: OpenImage, transfer: Transfer, saturation: float | None) -> Photo:
    part, channels = image.colour()
    spec = image.file.spec(part)
    says = declared(image, part)
    if transfer.curves:
        notes = tuple(note for note in says.notes if note != ASSUMED)
        says = Declared(transfer, says.matrix, "set by the user", notes)
    table, top = _table(image, spec, says.transfer)
    shape = spec.height, spec.width
    light = np.empty((*shape, 3), np.float32)
    bright, dark, broken = np.zeros(shape, bool), np.zeros(shape, bool), 0
    scale = np.asarray(image.container.scale, np.float32)
    for first, block in image.blocks(part, channels):
        rows = slice(first, first + len(block))
        if table is not None:
            light[rows] = _looked_up(block, table)
            bright[rows], dark[rows] = clipped(block, top), black(block)
        else:
            light[rows] = block
            if not np.isfinite(light[rows]).all():
                broken += int((~np.isfinite(light[rows])).any(axis=2).sum())
            if not says.transfer.is_linear:
                light[rows] = says.transfer.decode(light[rows])
            if image.container.scale != (1.0, 1.0, 1.0):
                light[rows] /= scale
            dark[rows] = black(light[rows])
            if saturation is not None:
                bright[rows] = clipped(light[rows], saturation)
        if says.matrix is not None:
            light[rows] = light[rows] @ says.matrix.T.astype(np.float32)
    if broken:
        raise InputError(
            f"has {broken} pixels that are NaN or infinite; expected finite numbers",
            file=image.path,
        )
    info = PhotoInfo(
        image.container.kind,
        says.transfer,
        says.reason,
        levels=None if table is None else len(table),
        saturation=saturation if table is None else float(table[-1].min()),
        notes=says.notes + _more_pages(image, part),
        mixed=says.matrix is not None,
    )
    return Photo(light, bright, dark, info)


def _table(
    image: OpenImage, spec: oiio.ImageSpec, transfer: Transfer
) -> tuple[NDArray[np.float32] | None, int]:
    """(linear light of each code, largest code) of an integer format; (None, 0) for floats."""
    if spec.format.basetype in (oiio.HALF, oiio.FLOAT, oiio.DOUBLE):
        return None, 0
    top = {oiio.UINT8: 255, oiio.UINT16: 65535}.get(spec.format.basetype)
    if top is None:
        raise InputError(
            f"has pixels of type {spec.format}; expected 8 or 16 bits, or floating point",
            file=image.path,
        )
    return transfer.table(top + 1), top


def _looked_up(block: NDArray, table: NDArray[np.float32]) -> NDArray[np.float32]:
    """(rows, w, 3) light of (rows, w, 1 or 3) codes."""
    if block.shape[2] == 1:
        return table[block[:, :, 0]]
    if (table[:, :1] == table).all():
        return table[:, 0][block]
    return np.stack([table[:, c][block[:, :, c]] for c in range(3)], axis=2)


def _more_pages(image: OpenImage, part: int) -> tuple[str, ...]:
    if image.container.kind != "tiff" or image.file.spec(part + 1).nchannels <= 0:
        return ()
    return ("the file has several pages; only the first is read.",)


def _raw(path: Path, transfer: Transfer) -> Photo:
    found = develop(path)
    light = np.empty(found.camera.shape, np.float32)
    dark = np.empty(found.clipped.shape, bool)
    for top in range(0, len(light), ROWS):
        rows = slice(top, top + ROWS)
        block = found.camera[rows]
        dark[rows] = black(block)
        linear = block * np.float32(1 / 65535)
        if found.matrix is not None:
            linear = linear @ found.matrix.T.astype(np.float32)
        light[rows] = transfer.decode(linear) if transfer.curves else linear
    reason = f"camera RAW is linear; the camera's white balance, demosaiced by {DEMOSAIC}"
    info = PhotoInfo(
        "raw",
        transfer if transfer.curves else Transfer.named("linear"),
        "set by the user" if transfer.curves else reason,
        levels=65536,
        saturation=1.0,
        white_balance=found.white_balance,
        notes=(
            *found.notes,
            f"the sensor saturates at {found.saturation:g} above black; this is scaled to 1.0.",
        ),
        mixed=found.matrix is not None,
    )
    return Photo(light, found.clipped, dark, info)
