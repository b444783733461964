"""Write the maps of a fit with materials that vary, as a job."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path

from ..concurrency.job import Job, Step, finished
from ..jobs import CaptureResult
from ..scan import Scan
from .maps_result import MapsResult, baked_maps
from .material import from_fit
from .texels import rasterise
from .write import MapFile, write_maps

BAKING, WRITING = "computing the maps", "writing the maps"  # names of the stages
BAKED = 0.7  # fraction of the time after which the maps are computed


class BakeJob(Job):
    """Sets ``maps``, and ``files`` that it writes into ``folder``: colours as 8-bit sRGB PNGs, for
    Blender's glTF exporter writes linear ones as if they were in sRGB.

    scan: of the fit, its mesh with texture coordinates; unwrapped: whether these are not the scan's
    own. size: texels a side.
    """

    def __init__(
        self, result: CaptureResult, scan: Scan, unwrapped: bool, size: int, folder: Path
    ) -> None:
        super().__init__()
        self.result, self.scan, self.unwrapped = result, scan, unwrapped
        self.size, self.folder = size, folder
        self.maps: MapsResult | None = None
        self.files: list[MapFile] = []

    def run(self) -> Iterator[Step]:
        """Two steps."""
        result, scan = self.result, self.scan
        yield Step(BAKING, 0.0)
        texels = rasterise(scan.mesh, self.size)
        surface = finished(result.varying)
        own = from_fit(result)
        maps = baked_maps(result.capture, scan, texels, surface, own, self.unwrapped)
        yield Step(WRITING, BAKED)
        self.maps, self.files = maps, write_maps(self.folder, maps, "exr", "png")
