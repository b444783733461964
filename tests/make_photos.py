"""Write photo files byte by byte, with known content and metadata, for tests of the readers."""

from __future__ import annotations

import struct
import zlib
from pathlib import Path

import numpy as np
import OpenImageIO as oiio

CODES = {1: "B", 2: "s", 3: "H", 4: "I", 5: "II", 7: "s", 9: "i", 10: "ii", 11: "f"}


def ascii_tag(text: str) -> tuple[int, bytes]:
    return 2, text.encode() + b"\0"


def rationals(*pairs: tuple[int, int], signed: bool = False) -> tuple[int, list]:
    return (10 if signed else 5), [number for pair in pairs for number in pair]


def tiff_bytes(main: dict, exif=None, gps=None, pixels: bytes = b"", order: str = "<") -> bytes:
    """Return a TIFF of one directory and its Exif and GPS directories; tag → (type, values).

    ``pixels`` are one strip; StripOffsets (or what the caller gives as None) points to it.
    """
    main = dict(main)
    parts = [(0x8769, exif), (0x8825, gps)]
    for tag, part in parts:
        if part is not None:
            main[tag] = (4, [0])
    if pixels:
        main[273], main[279] = (4, [0]), (4, [len(pixels)])

    def size(directory: dict) -> int:
        return 2 + 12 * len(directory) + 4

    def data(kind: int, values) -> tuple[int, bytes]:
        code = CODES[kind]
        if code == "s":
            return len(values), bytes(values)
        count = len(values) // len(code)
        return count, struct.pack(f"{order}{len(values)}{code[0]}", *values)

    def total(directory: dict) -> int:
        longer = (len(data(*v)[1]) for v in directory.values())
        return size(directory) + sum(n + n % 2 for n in longer if n > 4)

    place = 8 + total(main)
    for tag, part in parts:
        if part is not None:
            main[tag] = (4, [place])
            place += total(part)
    if pixels:
        main[273] = (4, [place])

    def written(directory: dict, start: int) -> bytes:
        head = struct.pack(order + "H", len(directory))
        tail, after = b"", start + size(directory)
        for tag, (kind, values) in sorted(directory.items()):
            count, body = data(kind, values)
            if len(body) > 4:
                field = struct.pack(order + "I", after + len(tail))
                tail += body + b"\0" * (len(body) % 2)
            else:
                field = body.ljust(4, b"\0")
            head += struct.pack(order + "HHI", tag, kind, count) + field
        return head + b"\0\0\0\0" + tail

    mark = b"II*\0" if order == "<" else b"MM\0*"
    out = mark + struct.pack(order + "I", 8) + written(main, 8)
    for _, part in parts:
        if part is not None:
            out += written(part, len(out))
    return out + pixels


def write_tiff(path: Path, pixels: np.ndarray, tags=None, order: str = "<", **more) -> None:
    """Write an uncompressed TIFF of (h, w) grey or (h, w, c); 8 or 16 bits or float32."""
    data = np.atleast_3d(pixels)
    height, width, channels = data.shape
    bits = data.dtype.itemsize * 8
    main = {
        256: (4, [width]), 257: (4, [height]), 258: (3, [bits] * channels), 259: (3, [1]),
        262: (3, [2 if channels > 2 else 1]), 277: (3, [channels]), 278: (4, [height]),
        284: (3, [1]), 339: (3, [3 if data.dtype.kind == "f" else 1] * channels),
    }  # fmt: skip
    if channels in (2, 4):
        main[338] = (3, [2])  # unassociated alpha
    body = data.astype(data.dtype.newbyteorder(order)).tobytes()
    path.write_bytes(tiff_bytes(main | (tags or {}), pixels=body, order=order, **more))


def chunk(kind: bytes, data: bytes) -> bytes:
    crc = struct.pack(">I", zlib.crc32(kind + data))
    return struct.pack(">I", len(data)) + kind + data + crc


def write_png(path: Path, pixels: np.ndarray, chunks=(), bits=None, palette=None) -> None:
    """Write a PNG: (h, w) or (h, w, 2..4), 8 or 16 bits; or (h, w) codes of ``bits`` 1, 2, 4."""
    data = np.atleast_3d(pixels)
    height, width, channels = data.shape
    kind = 3 if palette is not None else {1: 0, 2: 4, 3: 2, 4: 6}[channels]
    if bits:
        flat = ((data[:, :, 0:1] >> np.arange(bits)[::-1]) & 1).reshape(height, -1)
        rows = [np.packbits(row).tobytes() for row in flat.astype(np.uint8)]
    else:
        bits = data.dtype.itemsize * 8
        rows = [row.astype(data.dtype.newbyteorder(">")).tobytes() for row in data]
    head = struct.pack(">IIBBBBB", width, height, bits, kind, 0, 0, 0)
    more = [chunk(*c) for c in chunks]
    if palette is not None:
        more.append(chunk(b"PLTE", bytes(palette)))
    body = chunk(b"IDAT", zlib.compress(b"".join(b"\0" + row for row in rows)))
    start = b"\x89PNG\r\n\x1a\n" + chunk(b"IHDR", head)
    path.write_bytes(start + b"".join(more) + body + chunk(b"IEND", b""))


def write_jpeg(path: Path, pixels: np.ndarray, app: tuple[bytes, ...] = (), quality=100) -> None:
    """Write a JPEG of (h, w, 3), without chroma subsampling; ``app``: marker segments after SOI."""
    data = np.ascontiguousarray(np.atleast_3d(pixels), np.uint8)
    spec = oiio.ImageSpec(data.shape[1], data.shape[0], data.shape[2], "uint8")
    spec.attribute("CompressionQuality", quality)
    spec.attribute("jpeg:subsampling", "4:4:4")
    out = oiio.ImageOutput.create(str(path))
    out.open(str(path), spec)
    out.write_image(data)
    out.close()
    whole = path.read_bytes()
    path.write_bytes(whole[:2] + b"".join(app) + whole[2:])


def app1_exif(tiff: bytes) -> bytes:
    return b"\xff\xe1" + struct.pack(">H", 8 + len(tiff)) + b"Exif\0\0" + tiff


def app2_icc(profile: bytes) -> bytes:
    body = b"ICC_PROFILE\0\x01\x01" + profile
    return b"\xff\xe2" + struct.pack(">H", 2 + len(body)) + body


def write_hdr(path: Path, rgbe: np.ndarray, lines=(), resolution: str | None = None) -> None:
    """Write an uncompressed Radiance picture of (h, w, 4) bytes."""
    height, width = rgbe.shape[:2]
    text = "#?RADIANCE\n" + "".join(line + "\n" for line in lines) + "FORMAT=32-bit_rle_rgbe\n\n"
    text += (resolution or f"-Y {height} +X {width}") + "\n"
    path.write_bytes(text.encode() + np.ascontiguousarray(rgbe, np.uint8).tobytes())


def curv(*values: int) -> bytes:
    return b"curv\0\0\0\0" + struct.pack(f">I{len(values)}H", len(values), *values)


def para(function: int, *parameters: float) -> bytes:
    fixed = [round(number * 65536) for number in parameters]
    return b"para\0\0\0\0" + struct.pack(f">HH{len(fixed)}i", function, 0, *fixed)


def icc_profile(curve: bytes, columns=None, space: bytes = b"RGB ", name: str = "made") -> bytes:
    """Return a display profile with one curve; ``columns`` (3, 3): XYZ (D50) of R, G, B."""
    desc = b"desc\0\0\0\0" + struct.pack(">I", len(name) + 1) + name.encode() + b"\0"
    tags = {b"desc": desc}
    if space == b"GRAY":
        tags[b"kTRC"] = curve
    else:
        for letter, column in zip(b"rgb", np.asarray(columns).T, strict=True):
            fixed = [round(x * 65536) for x in column]
            tags[bytes([letter]) + b"XYZ"] = b"XYZ \0\0\0\0" + struct.pack(">3i", *fixed)
            tags[bytes([letter]) + b"TRC"] = curve
    table, body, place = b"", b"", 128 + 4 + 12 * len(tags)
    for key, data in tags.items():
        data += b"\0" * (-len(data) % 4)
        table += struct.pack(">4sII", key, place + len(body), len(data))
        body += data
    head = bytearray(128)
    struct.pack_into(">I", head, 0, place + len(body))
    head[8:12], head[12:16], head[16:20] = b"\2\x10\0\0", b"mntr", space
    head[20:24], head[36:40] = b"XYZ ", b"acsp"
    struct.pack_into(">3i", head, 68, 63190, 65536, 54061)
    return bytes(head) + struct.pack(">I", len(tags)) + table + body


SRGB_D50 = np.array(
    [[0.43607, 0.38515, 0.14307], [0.22249, 0.71687, 0.06061], [0.01392, 0.09708, 0.71410]]
)
ADOBE_D50 = np.array(
    [[0.60974, 0.20528, 0.14919], [0.31111, 0.62567, 0.06322], [0.01947, 0.06087, 0.74457]]
)


def write_dng(
    path: Path, mosaic: np.ndarray, black=64, white=4095, neutral=(0.5, 1.0, 0.625), **tags
) -> None:
    """Write a DNG with an uncompressed 16-bit RGGB mosaic.

    ``neutral``: camera values of white (D65). ``camera`` (3, 3): linear Rec.709 → camera values
    after white balance; default: identity.
    """
    height, width = mosaic.shape
    xyz = np.array([[0.4124, 0.3576, 0.1805], [0.2126, 0.7152, 0.0722], [0.0193, 0.1192, 0.9505]])
    camera = np.asarray(tags.get("camera", np.eye(3)))
    matrix = np.diag(neutral) @ camera @ np.linalg.inv(xyz)  # XYZ → camera
    fixed = [(round(x * 1000000), 1000000) for x in matrix.ravel()]
    main = {
        254: (4, [0]), 256: (4, [width]), 257: (4, [height]), 258: (3, [16]), 259: (3, [1]),
        262: (3, [32803]), 271: ascii_tag("Made"), 272: ascii_tag("By Hand"),
        274: (3, [tags.get("orientation", 1)]), 277: (3, [1]), 278: (4, [height]),
        33421: (3, [2, 2]), 33422: (1, [0, 1, 1, 2]),
        50706: (1, [1, 4, 0, 0]), 50707: (1, [1, 1, 0, 0]), 50708: ascii_tag("Made By Hand"),
        50714: (4, [black]), 50717: (4, [white]),
        50721: rationals(*fixed, signed=True), 50728: rationals(
            *((round(n * 10000), 10000) for n in neutral)), 50778: (3, [21]),
    }  # fmt: skip
    body = mosaic.astype("<u2").tobytes()
    path.write_bytes(tiff_bytes(main, exif=tags.get("exif"), pixels=body))
