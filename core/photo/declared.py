"""The encoding that a file declares: transfer curve to linear light, primaries, and the reason."""

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
    "16-bit file that does not declare its curve, read as sRGB. If its values are linear, set "
    'transfer = "linear".'
)
EDITS = (
    "Exposure2012", "Contrast2012", "Highlights2012", "Shadows2012", "Whites2012", "Blacks2012",
    "Texture", "Clarity2012", "Dehaze", "Vibrance", "Saturation", "VignetteAmount",
)  # fmt: skip


@dataclass(frozen=True)
class Declared:
    """The encoding of a file. transfer: the curve; matrix: (3, 3) linear file RGB → linear Rec.709,
    None for none; reason: why, one sentence; notes: sentences for the user."""

    transfer: Transfer
    matrix: Matrix | None
    reason: str
    notes: tuple[str, ...] = ()


def declared(image: OpenImage, part: int) -> Declared:
    """The encoding that a part of the file declares, or the usual assumption where it declares
    none."""
    spec = image.file.spec(part)
    found = _by_kind(image, spec)
    return Declared(found.transfer, found.matrix, found.reason, found.notes + _edits(spec))


def _by_kind(image: OpenImage, spec: oiio.ImageSpec) -> Declared:
    kind = image.container.kind
    floating = spec.format.basetype in (oiio.HALF, oiio.FLOAT, oiio.DOUBLE)
    if kind == "openexr":
        return _exr(spec)
    if kind == "hdr":
        return Declared(LINEAR, None, "Radiance .hdr files store linear light")
    notes: tuple[str, ...] = ()
    if kind == "png" and (stated := _cicp(image.container)):
        return stated
    icc = _attribute(spec, "ICCProfile")
    if icc is not None:
        profile = read_profile(bytes(np.asarray(icc, np.uint8)))
        if profile is not None:
            return _profiled(profile)
        notes = ("embedded colour profile ignored, because it has no simple curves or is damaged.",)
    if floating:
        reason = "floating-point files without a colour profile store linear light"
        return Declared(LINEAR, None, reason, notes)
    stated = _png(image.container) if kind == "png" else _exif(image)
    if stated is not None:
        return Declared(stated.transfer, stated.matrix, stated.reason, notes + stated.notes)
    if spec.format.basetype == oiio.UINT16:
        notes += (ASSUMED,)
    return Declared(SRGB, None, "the file declares no curve; sRGB is assumed", notes)


def _exr(spec: oiio.ImageSpec) -> Declared:
    reason = "EXR files store linear light"
    chromaticities = _attribute(spec, "chromaticities")
    if chromaticities is None or len(chromaticities) != 8:
        return Declared(LINEAR, None, reason)
    try:
        matrix = from_chromaticities(tuple(float(n) for n in chromaticities))
    except ValueError:
        return Declared(LINEAR, None, reason, ("chromaticities ignored, they are impossible.",))
    more = "" if matrix is None else "; its primaries are converted to Rec.709"
    return Declared(LINEAR, matrix, reason + more)


def _profiled(profile: Profile) -> Declared:
    transfer = Transfer("icc", profile.curves)
    for known in (SRGB, LINEAR):  # tables of profiles are rounded to 8 to 16 bits
        if all(same_curve(curve, known.curves[0]) for curve in profile.curves):
            transfer = known
    primaries = "" if profile.matrix is None else "; its primaries are converted to Rec.709"
    reason = f"from the embedded colour profile {profile.name or '(unnamed)'}{primaries}"
    return Declared(transfer, profile.matrix, reason)


def _cicp(container: Container) -> Declared | None:
    code = container.chunks.get("cICP", b"")
    if len(code) != 4 or code[1] not in CICP_CURVES or code[0] not in CICP_PRIMARIES or code[2]:
        return None
    primaries = CICP_PRIMARIES[code[0]]
    matrix = None if primaries is None else from_chromaticities(primaries)
    return Declared(Transfer.named(CICP_CURVES[code[1]]), matrix, "from the PNG's cICP chunk")


def _png(container: Container) -> Declared | None:
    if "sRGB" in container.chunks:
        return Declared(SRGB, None, "from the PNG's sRGB chunk")
    gamma = container.chunks.get("gAMA", b"")
    if len(gamma) != 4:
        return None
    number = int.from_bytes(gamma, "big")
    if number == 45455:
        return Declared(SRGB, None, "the PNG's gAMA chunk is 1/2.2, which stands for sRGB")
    if number == 100000:
        return Declared(LINEAR, None, "from the PNG's gAMA chunk")
    if not 10000 <= number <= 1000000:
        return None
    name = f"gamma:{100000 / number:.6g}"
    return Declared(Transfer.named(name), None, "from the PNG's gAMA chunk")


def _exif(image: OpenImage) -> Declared | None:
    tags = find_tags(image.path)
    value = tags.exif.get(0xA001)
    space = value[0] if isinstance(value, tuple) else None
    if space == 2 or (space == 0xFFFF and tags.interoperability.get(1) == "R03"):
        matrix = from_chromaticities(ADOBE_RGB)
        return Declared(ADOBE, matrix, "its EXIF states Adobe RGB; converted to Rec.709 primaries")
    if space == 1:
        return Declared(SRGB, None, "its EXIF states sRGB")
    if space == 0xFFFF:
        note = "its EXIF states 'uncalibrated' and it has no colour profile; sRGB is assumed."
        return Declared(SRGB, None, "the file declares no curve; sRGB is assumed", (note,))
    return None


def _attribute(spec: oiio.ImageSpec, name: str) -> Any:
    try:
        return spec.getattribute(name)
    except UnicodeDecodeError:
        return None


def _edits(spec: oiio.ImageSpec) -> tuple[str, ...]:
    """Tone edits by Camera Raw or Lightroom, from the XMP block that they write."""
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
    what = f"tones changed ({', '.join(done)})" if done else "a base curve was applied"
    return (
        f"developed from RAW: {what}. Calibrate with a colour chart, or develop the RAW linearly.",
    )
