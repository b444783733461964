"""Export as a page for browsers: the measured BRDF and its portable forms on a sphere."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

import numpy as np

from ..basis.log_table import LogTable
from ..viewer.model_tables import ViewerMaterial
from ..viewer.page import FILE_NAME, write_viewer
from ..viewer.skies import computed_skies
from .losses import Loss
from .subject import Subject

NO_SURFACE = "the object; the viewer in the report of a fit shows it"


def write_web(folder: Path, subjects: Sequence[Subject]) -> list[Loss]:
    """Write viewer.html with all materials. Raises InputError where its program was not built."""
    materials = [
        ViewerMaterial.of(
            subject.name,
            subject.material.brdf,
            {
                "lobes": subject.lobes.stack.evaluate,
                "principled": subject.material.principled.evaluate,
            },
        )
        for subject in subjects
    ]
    title = ", ".join(subject.name for subject in subjects)
    notes = [note for subject in subjects for note in subject.scale_note]
    write_viewer(
        folder / FILE_NAME,
        f"Measured: {title}",
        materials,
        computed_skies(),
        notes=[f"{note[:1].upper()}{note[1:]}." for note in dict.fromkeys(notes)],
    )
    return [
        Loss(
            "web",
            subject.name,
            (FILE_NAME,),
            {
                "measured": subject.error(_stored(material).evaluate),
                "lobe stack": subject.error(subject.lobes.stack.evaluate),
                "Principled": subject.error(subject.material.principled.evaluate),
            },
            dropped=(NO_SURFACE,),
            notes=subject.scale_note,
        )
        for subject, material in zip(subjects, materials, strict=True)
    ]


def _stored(material: ViewerMaterial) -> LogTable:
    """The measured BRDF as the page stores it, in half floats."""
    return LogTable(material.grid, material.tables["measured"].astype(np.float32))
