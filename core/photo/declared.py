"""What a file says about its own numbers: the curve to linear light, the primaries, and why."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
import OpenImageIO as oiio

from .container import Container
from .exif_place import find_tags
from .icc import Profile, read_profile
from .image import OpenImage
from .primaries import ADOBE_RGB, Matrix, from_chromaticities
from .transfer import Transfer, same_curve

SRGB, LINEAR = Transfer.named("srgb"), Transfer.named("linear")
ADOBE = Transfer.named("gamma:2.19921875")  # Adobe RGB (1998), 4.3.1.2: 2 51/256
# PNG cICP: codes of ITU-T H.273
CICP_CURVES = {1: "bt709", 6: "bt709", 8: "linear", 13: "srgb", 14: "bt709", 15: "bt709"}
CICP_PRIMARIES = {
    1: None,
    9: (0.708, 0.292, 0.170, 0.797, 0.131, 0.046, 0.3127, 0.3290),
    12: (0.680, 0.320, 0.265, 0.690, 0.150, 0.060, 0.3127, 0.3290),
}
ASSUMED = (
    "16-bit without a statement of its curve: taken as sRGB; if the numbers are linear, say "
    'transfer = "linear"'
)
EDITS = (
    "Exposure2012", "Contrast2012", "Highlights2012", "Shadows2012", "Whites2012", "Blacks2012",
    "Texture", "Clarity2012", "Dehaze", "Vibrance", "Saturation", "VignetteAmount",
)  # fmt: skip


@dataclass(frozen=True)
class Declared:
    """transfer: the curve; matrix: (3, 3) linear file RGB → linear Rec.709, None for none;
    reason: one sentence; notes: what the user should know."""

    transfer: Transfer
    matrix: Matrix | None
    reason: str
    notes: tuple[str, ...] = ()


def declared(image: OpenImage, part: int) -> Declared:
    """The file's own statement, or the usual assumption where it makes none."""
    spec = image.file.spec(part)
    found = _by_kind(image, spec)
    return Declared(found.transfer, found.matrix, found.reason, found.notes + _edits(spec))


def _by_kind(image: OpenImage, spec: oiio.ImageSpec) -> Declared:
    kind = image.container.kind
    floating = spec.format.basetype in (oiio.HALF, oiio.FLOAT, oiio.DOUBLE)
    if kind == "openexr":
        return _exr(spec)
    if kind == "hdr":
        return Declared(LINEAR, None, "Radiance .hdr files hold linear light")
    notes: tuple[str, ...] = ()
    if kind == "png" and (stated := _cicp(image.container)):
        return stated
    icc = _attribute(spec, "ICCProfile")
    if icc is not None:
        profile = read_profile(bytes(np.asarray(icc, np.uint8)))
        if profile is not None:
            return _profiled(profile)
        notes = ("the embedded colour profile has no plain curves (or is damaged); it is not used",)
    if floating:
        reason = "floating-point files without a colour profile hold linear light"
        return Declared(LINEAR, None, reason, notes)
    stated = _png(image.container) if kind == "png" else _exif(image)
    if stated is not None:
        return Declared(stated.transfer, stated.matrix, stated.reason, notes + stated.notes)
    if spec.format.basetype == oiio.UINT16:
        notes += (ASSUMED,)
    return Declared(SRGB, None, "the file does not say; the sRGB curve is assumed", notes)


def _exr(spec: oiio.ImageSpec) -> Declared:
    reason = "EXR files hold linear light"
    numbers = _attribute(spec, "chromaticities")
    if numbers is None or len(numbers) != 8:
        return Declared(LINEAR, None, reason)
    try:
        matrix = from_chromaticities(tuple(float(n) for n in numbers))
    except ValueError:
        return Declared(LINEAR, None, reason, ("its chromaticities are impossible; not used",))
    more = "" if matrix is None else ", here of other primaries, converted to Rec.709"
    return Declared(LINEAR, matrix, reason + more)


def _profiled(profile: Profile) -> Declared:
    transfer = Transfer("icc", profile.curves)
    for known in (SRGB, LINEAR):  # profiles round: their tables hold 8 to 16 bits
        if all(same_curve(curve, known.curves[0]) for curve in profile.curves):
            transfer = known
    primaries = "" if profile.matrix is None else "; its primaries are converted to Rec.709"
    reason = f"the embedded colour profile {profile.name or '(unnamed)'} says so{primaries}"
    return Declared(transfer, profile.matrix, reason)


def _cicp(container: Container) -> Declared | None:
    code = container.chunks.get("cICP", b"")
    if len(code) != 4 or code[1] not in CICP_CURVES or code[0] not in CICP_PRIMARIES or code[2]:
        return None
    primaries = CICP_PRIMARIES[code[0]]
    matrix = None if primaries is None else from_chromaticities(primaries)
    return Declared(Transfer.named(CICP_CURVES[code[1]]), matrix, "the PNG's cICP chunk says so")


def _png(container: Container) -> Declared | None:
    if "sRGB" in container.chunks:
        return Declared(SRGB, None, "the PNG's sRGB chunk says so")
    gamma = container.chunks.get("gAMA", b"")
    if len(gamma) != 4:
        return None
    number = int.from_bytes(gamma, "big")
    if number == 45455:
        return Declared(SRGB, None, "the PNG's gAMA chunk says 1/2.2, which stands for sRGB")
    if number == 100000:
        return Declared(LINEAR, None, "the PNG's gAMA chunk says linear")
    if not 10000 <= number <= 1000000:
        return None
    name = f"gamma:{100000 / number:.6g}"
    return Declared(Transfer.named(name), None, "the PNG's gAMA chunk says so")


def _exif(image: OpenImage) -> Declared | None:
    tags = find_tags(image.path)
    value = tags.exif.get(0xA001)
    space = value[0] if isinstance(value, tuple) else None
    if space == 2 or (space == 0xFFFF and tags.interoperability.get(1) == "R03"):
        matrix = from_chromaticities(ADOBE_RGB)
        return Declared(ADOBE, matrix, "its Exif says Adobe RGB; converted to Rec.709 primaries")
    if space == 1:
        return Declared(SRGB, None, "its Exif says sRGB")
    if space == 0xFFFF:
        note = "its Exif says 'uncalibrated' and it embeds no profile; sRGB is assumed"
        return Declared(SRGB, None, "the file does not say; the sRGB curve is assumed", (note,))
    return None


def _attribute(spec: oiio.ImageSpec, name: str) -> Any:
    try:
        return spec.getattribute(name)
    except UnicodeDecodeError:
        return None


def _edits(spec: oiio.ImageSpec) -> tuple[str, ...]:
    """What Camera Raw or Lightroom did to the tones, from the XMP block they leave."""
    if str(_attribute(spec, "crs:AlreadyApplied")).lower() not in ("true", "1"):
        return ()
    done = []
    for name in EDITS:
        value = _attribute(spec, f"crs:{name}")
        try:
            if value is not None and float(value) != 0:
                done.append(f"{name.removesuffix('2012')} {float(value):+g}")
        except (TypeError, ValueError):
            continue
    what = f"changed its tones ({', '.join(done)})" if done else "made it, with its own base curve"
    return (f"raw processing {what}: calibrate with a colour chart, or develop linear",)
