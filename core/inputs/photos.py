"""Read the lit photos of a capture as linear radiance, all in one unit."""

from __future__ import annotations

from dataclasses import dataclass
from functools import partial
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from ..calibrate.chart import ChartTone, chart_tone
from ..capture import Capture
from ..counted import counted
from ..errors import InputError, PatinaError
from ..noise import MergedNoise, PixelNoise
from ..photo import read_encoded
from ..photo.bracket import merge_bracket
from ..photo.exif import Exif, read_exif
from ..photo.noise_estimate import estimate_noise
from ..photo.photo import read_photo
from ..photo.transfer import Transfer
from .same_content import copied_photos

LINEAR_SUFFIXES, ENCODED_SUFFIXES = (".exr", ".hdr"), (".jpg", ".jpeg")
"""Of files whose values are nearly always linear, and nearly never."""


@dataclass(frozen=True)
class LitPhoto:
    """One photo as radiance.

    radiance: (h, w, 3) float32 linear, divided by the exposure. usable: (h, w) not clipped; in a
    bracket, not clipped in at least one exposure. noise: of the radiance, None where it was not
    estimated. notes: how the pixels were read, sentences. mixed: whether a matrix of primaries
    mixed the channels.
    """

    radiance: NDArray[np.float32]
    usable: NDArray[np.bool_]
    noise: PixelNoise | None = None
    notes: tuple[str, ...] = ()
    mixed: bool = False


@dataclass(frozen=True)
class LitPhotos:
    """How the photos of a capture are read.

    chart: tone curve measured from a chart, or None. exposures: for each photo, one per file.
    first: the EXIF exposure that counts as 1, None where EXIF is not used. notes: sentences for
    the user.
    """

    capture: Capture
    chart: ChartTone | None
    exposures: tuple[tuple[float, ...], ...]
    first: float | None
    notes: tuple[str, ...]

    @classmethod
    def open(cls, capture: Capture) -> LitPhotos:
        """Measure the tone curve from the chart, if any, and read the exposures. Raises
        InputError."""
        chart = _chart(capture)
        exposures, first, notes = _exposures(capture)
        if chart is not None:
            notes = (*notes, *chart.notes)
        return cls(
            capture,
            chart,
            exposures,
            first,
            (*notes, *_unusual_curves(capture), *copied_photos(capture)),
        )

    def read(self, place: int) -> LitPhoto:
        """One lit photo. Raises InputError naming the capture's key."""
        return self._read(place)

    def read_with_noise(self, place: int) -> LitPhoto:
        """The same with the noise, also of a single exposure."""
        return self._read(place, noise=True)

    def _read(self, place: int, noise: bool = False) -> LitPhoto:
        photo = self.capture.photos[place]
        try:
            curve = self.curve(place)
            if len(photo.files) == 1:
                one = read_photo(photo.files[0], curve, photo.saturation)
                exposure = self.exposures[place][0]
                found = estimate_noise(one).per_exposure(exposure) if noise else None
                radiance = one.radiance
                if exposure != 1.0:
                    radiance /= np.float32(exposure)
                curve_note = () if one.info.levels is None else (one.info.sentence,)
                notes = (*curve_note, *one.info.notes)
                return LitPhoto(radiance, ~one.clipped, found, notes, one.info.mixed)
            merged = merge_bracket(
                [partial(read_photo, file, curve, photo.saturation) for file in photo.files],
                self.exposures[place],
                names=[file.name for file in photo.files],
            )
        except InputError as error:
            raise self.capture.error(str(error), "photo", place, "file") from error
        notes = (f"{counted(len(photo.files), 'exposure')} merged.", *merged.warnings)
        return LitPhoto(merged.radiance, merged.valid, MergedNoise(merged.variance), notes)

    def read_other(self, file: Path, exposure: float | None = None) -> LitPhoto:
        """A photo of a sphere or a white target, in the unit of the lit photos. Raises
        InputError."""
        own = {photo.transfer for photo in self.capture.photos}
        if len(own) > 1:
            raise InputError(
                f"the photos have different transfer curves, so the curve of {file.name} is "
                "unknown; give one curve for all photos with [tone] transfer"
            )
        photo = read_photo(file, self._curve(own.pop()))
        if exposure is None:
            exposure = self.exposure_of(file)
        return LitPhoto(photo.radiance / np.float32(exposure), ~photo.clipped)

    def check_comparable(self, file: Path) -> None:
        """Check that the exposure of ``file`` relative to the lit photos is known. Raises
        InputError."""
        if self.first is not None:
            if read_exif(file).relative_exposure is None:
                raise InputError(
                    f"{file.name} has no exposure in its EXIF, but the lit photos have; give its "
                    "exposure relative to the first lit photo"
                )
        elif any(e != 1.0 for photo in self.exposures for e in photo):
            raise InputError(
                f"exposure is given for the lit photos but not for {file.name}; give it there too"
            )

    def exposure_of(self, file: Path) -> float:
        """The EXIF exposure of another photo relative to the first lit one; 1 where unknown."""
        own = None if self.first is None else read_exif(file).relative_exposure
        return 1.0 if own is None or self.first is None else own / self.first

    def curve(self, place: int) -> Transfer:
        """The transfer curve that a photo is read with; "auto" is the curve its file states."""
        return self._curve(self.capture.photos[place].transfer)

    def _curve(self, own: str | None) -> Transfer:
        if own is not None:
            return Transfer.named(own)
        if self.chart is not None:
            return self.chart.transfer
        return Transfer.named(self.capture.tone.transfer)


def _unusual_curves(capture: Capture) -> list[str]:
    """Sentences on stated transfer curves that files of their kind seldom have."""
    odd: dict[str, list[str]] = {}
    for photo in capture.photos:
        name = photo.transfer or capture.tone.transfer
        if name == "auto":
            continue
        linear, suffix = Transfer.named(name).is_linear, photo.file.suffix.lower()
        if (suffix in LINEAR_SUFFIXES and not linear) or (suffix in ENCODED_SUFFIXES and linear):
            odd.setdefault(f"{name!r} for {suffix[1:].upper()} files", []).append(photo.file.name)
    return [
        f"The capture states the transfer curve {what}, which is unusual ({names[0]}"
        f"{'' if len(names) == 1 else f' and {len(names) - 1} more'}). If it is wrong, "
        "reflectances are wrong by up to a factor of 12; remove transfer to use the curve of the "
        "file."
        for what, names in odd.items()
    ]


def _chart(capture: Capture) -> ChartTone | None:
    entry = capture.tone.chart
    if entry is None:
        return None
    try:
        return chart_tone(read_encoded(entry.photo), entry.corners, entry.reflectance)
    except PatinaError as error:
        raise capture.error(str(error), "tone", "chart") from error


def _exposures(
    capture: Capture,
) -> tuple[tuple[tuple[float, ...], ...], float | None, tuple[str, ...]]:
    """(exposures of every photo's files, EXIF exposure that counts as 1, notes).

    Exposures in the capture file are used as they are. If the file gives none at all, they come
    from EXIF: the first photo's exposure is 1 and the others are relative to it, so that given
    values such as an irradiance keep the unit of that photo's pixels. The two units do not mix.
    """
    given = [photo.exposures is not None for photo in capture.photos]
    needed = [(i, f) for i, p in enumerate(capture.photos) if not given[i] for f in p.files]
    exif = {file: read_exif(file) for _, file in needed}
    without = [(i, f) for i, f in needed if exif[f].relative_exposure is None]
    from_exif = len(without) < len(needed)
    if from_exif and any(given):
        raise capture.error(
            "exposure is given for this photo, but other photos have only EXIF, which is in "
            "another unit; give exposure for all photos or for none",
            "photo", given.index(True), "exposure",
        )  # fmt: skip
    if from_exif and without:
        place, file = without[0]
        raise capture.error(
            f"{file.name} has no exposure in its EXIF ({', '.join(exif[file].missing)} missing), "
            "but other photos have; give exposure for all photos",
            "photo", place, "exposure",
        )  # fmt: skip
    if not from_exif:
        for place, photo in enumerate(capture.photos):
            if photo.exposures is None and len(photo.files) > 1:
                raise capture.error(
                    "the files of this bracket have no exposure in their EXIF; give exposure = "
                    "[...], one number per file",
                    "photo", place, "exposure",
                )  # fmt: skip
        return tuple(p.exposures or (1.0,) for p in capture.photos), None, ()
    _check_flash(capture, exif)
    first = exif[needed[0][1]].relative_exposure or 1.0
    exposures = tuple(
        tuple((exif[f].relative_exposure or first) / first for f in p.files) for p in capture.photos
    )
    differ = len({round(e, 3) for photo in exposures for e in photo}) > 1
    notes = (f"Exposures come from EXIF, relative to {needed[0][1].name}.",) if differ else ()
    return exposures, first, notes


def _check_flash(capture: Capture, exif: dict[Path, Exif]) -> None:
    """Raise InputError where photos with flash have different shutter times: dividing by them would
    be wrong, because a flash's light does not depend on the shutter time."""
    mounted = {light.name for light in capture.lights if light.mounted is not None}
    places = [i for i, photo in enumerate(capture.photos) if photo.light in mounted]
    times = {exif[file].exposure_time for i in places for file in capture.photos[i].files}
    if len(times) > 1:
        raise capture.error(
            "the exposure times of these photos differ, but a flash's light does not depend on "
            "them; give exposure for all photos (ISO / f-number², or 1 where these are equal)",
            "photo", places[0], "exposure",
        )  # fmt: skip
