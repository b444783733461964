"""The errors and omissions of an export: losses.txt for users, losses.json for programs."""

from __future__ import annotations

import json
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from ..angles import Angles, cosines
from ..appearance.cube_root import quadrature
from ..files import write_text_atomic

Array = NDArray[np.floating]
Evaluate = Callable[[Angles], Array]

FORMAT = 1
MEASURE = (
    "relative cube-root error ‖∛(f cosθi) − ∛(ρ cosθi)‖ / ‖∛(ρ cosθi)‖ (Fores et al. 2012), "
    "directions as on the MERL grid, light and view within 82° of the normal"
)


@dataclass(frozen=True)
class Loss:
    """The accuracy of one material in one format.

    format: as in ``--to``. files: the written files. errors: representation → its relative
    cube-root error against the fitted table; the first one is what a program shows that opens the
    file. dropped: inputs or facts that the format cannot represent. notes: other remarks.
    """

    format: str
    material: str
    files: tuple[str, ...]
    errors: dict[str, float]
    dropped: tuple[str, ...] = ()
    notes: tuple[str, ...] = ()

    def lines(self) -> list[str]:
        """The lines of losses.txt for this material and format."""
        head = f"{self.material} as {self.format} ({', '.join(self.files)})"
        shown = [f"  {what}: {percent(error)}" for what, error in self.errors.items()]
        omitted = [f"  lost: {what}" for what in self.dropped]
        return [head, *shown, *omitted, *(f"  note: {note}" for note in self.notes)]


def percent(error: float) -> str:
    """A relative error as text, in per cent."""
    return "0 %" if error == 0 else "< 0.01 %" if error < 1e-4 else f"{100 * error:.2g} %"


def cube_root_error(evaluate: Evaluate, truth: Evaluate) -> float:
    """Relative cube-root error of ``evaluate(angles) -> (n, 3)`` against ``truth``, both in 1/sr.
    Negative values count as 0."""
    angles, weight = quadrature()
    cos_i, _ = cosines(*angles)
    root = [
        np.cbrt(np.maximum(np.asarray(f(angles), float), 0.0) * cos_i[:, None])
        for f in (evaluate, truth)
    ]
    scale = np.sqrt(weight)[:, None]
    length = max(float(np.linalg.norm(scale * root[1])), 1e-12)
    return float(np.linalg.norm(scale * (root[0] - root[1])) / length)


def write_losses(folder: Path, losses: Sequence[Loss], source: str) -> list[str]:
    """Write losses.txt and losses.json into a folder; returns the lines of the text.

    source: the name of what was exported, for the heading. The files are written atomically.
    """
    lines = [
        f"Accuracy of these files, compared with {source}, and what they cannot represent.",
        f"Measure: {MEASURE}.",
        "",
    ]
    for loss in losses:
        lines += [*loss.lines(), ""]
    content = {"format": FORMAT, "measure": MEASURE, "losses": [vars(loss) for loss in losses]}
    write_text_atomic(folder / "losses.txt", "\n".join(lines))
    text = json.dumps(content, indent=1, allow_nan=False) + "\n"
    write_text_atomic(folder / "losses.json", text)
    return lines
