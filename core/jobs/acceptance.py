"""Whether a second fit is refused: a model may explain the photos it was fitted to by something
that is not there, and it then predicts photos that it has not seen worse than without."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from ..diagnose.selection.diagnosis import Diagnosis
from ..diagnose.selection.held_out_error import held_out_photo_error
from ..diagnose.solver.model_fit import ModelFit
from ..fit.held_out import HeldOut
from .fit_job import MaterialResult

MORE = 0.03  # ln of what errors of unseen photos may grow by
USELESS = 0.1  # the same of the second fit alone, whatever the causes are worth


@dataclass(frozen=True)
class Rejection:
    """words: what speaks against a second fit; of_cause: whether it speaks against what it was rid
    of, too. Else that is there, but what is known of it does not tell the materials better: under a
    lamp as wide as a highlight none is seen."""

    words: str
    of_cause: bool


@dataclass(frozen=True)
class Refit:
    """A material's second fit. material: None where it could not be fitted; light: of each photo
    the RMS radiance of its samples, as it shows it, over that of all it shows; warnings: what is to
    be said; blurred: whether its highlights are still as wide as the photos show them."""

    material: MaterialResult | None
    light: Mapping[int, float]
    warnings: tuple[str, ...]
    blurred: bool = False


def seen_jointly(found: Diagnosis, fitted: ModelFit) -> float:
    """ln of what the error of unseen photos grew by where the materials and all causes are fitted
    together; 0 of one photo. fitted: with the causes that the second fit takes into account."""
    before = found.error_before.photos
    known = fitted is found.after
    after = found.error_after.photos if known else held_out_photo_error(fitted)
    return 0.0 if before is None or after is None else grown(before, after)


def worse(
    before: Sequence[MaterialResult], after: Sequence[Refit], jointly: float = 0.0
) -> Rejection | None:
    """Where unseen photos are predicted worse than without.

    Every photo counts alike, beside itself without the causes: over all photos together, the worst
    would decide. Both errors are relative to all that a photo shows: in light that a steep curve
    was taken from, the same error is another part. jointly: the same of the materials and causes
    fitted together, whose photos are unseen, too: of eight photos, what the materials' own fits say
    is chance by a few percent.
    """
    judged = [
        by_photo(one.held_out, other.material.held_out, other.light)
        for one, other in zip(before, after, strict=True)
        if other.material is not None
        and one.held_out is not None
        and other.material.held_out is not None
    ]
    errors = [each for each in judged if each is not None]
    each_grown = [grown(*each) for each in errors]
    mean = float(np.mean(each_grown)) if each_grown else -np.inf
    of_cause = mean + jointly > MORE
    if not of_cause and mean < USELESS:
        return None
    said = ", ".join(f"{100 * a:.1f} to {100 * b:.1f} %" for a, b in errors)
    words = (
        f"with it, unseen photos are predicted worse: a usual one's error goes from {said}, and by "
        f"{100 * np.expm1(jointly):+.0f} % where materials and causes are fitted at once"
    )
    return Rejection(words, of_cause)


def by_photo(
    before: HeldOut, after: HeldOut, light: Mapping[int, float] | None = None
) -> tuple[float, float] | None:
    """Geometric means of the errors of photos, over all that they show; None where no photo has
    both. light: Again.light of the second, None: all that they show in both."""
    if light is None:
        light = dict.fromkeys(after.per_photo, 1.0)
    photos = sorted(before.per_photo.keys() & after.per_photo.keys() & light.keys())
    if not photos:
        return None
    both = [(before.per_photo[p], after.per_photo[p] * light[p]) for p in photos]
    first, second = np.exp(np.mean(np.log(np.maximum(both, 1e-9)), axis=0))
    return float(first), float(second)


def grown(before: float, after: float) -> float:
    """ln of what an error grew by."""
    return float(np.log(max(after, 1e-9) / max(before, 1e-9)))
