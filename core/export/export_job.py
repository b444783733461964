"""Export a result folder to formats that need no Blender, as a job."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from pathlib import Path

from ..concurrency.job import Job, Step
from ..result import read_result
from .losses import Loss
from .material_formats import export_materials


class ExportMaterialsJob(Job):
    """Read a result folder and export its materials. Sets ``losses``: what the formats cannot
    store.

    cache: folder of the bases that were computed from the user's own MERL files. out, formats: as
    of export_materials.
    """

    def __init__(self, result: Path, cache: Path, out: Path, formats: Sequence[str]) -> None:
        super().__init__()
        self.folder, self.cache, self.out, self.formats = result, cache, out, list(formats)
        self.losses: list[Loss] = []

    def run(self) -> Iterator[Step]:
        """The steps."""
        result = read_result(self.folder, self.cache)
        self.losses, _ = yield from export_materials(self.out, result, self.formats)
