"""The samples and surface views of a capture with one material, as the fit job takes them."""

from __future__ import annotations

from pathlib import Path

from patina.core.capture import read_capture
from patina.core.geometry import RayScene, SurfaceView, view_surface
from patina.core.job import inputs
from patina.core.samples import Margins, SampleTable, sample_photo
from patina.core.samples.take import light_surface, trusted_pixels


def sampled(path: Path) -> tuple[SampleTable, list[SurfaceView]]:
    """(all samples, one view a photo)."""
    capture = read_capture(path)
    scan = inputs.open_scan(capture)
    rays = RayScene.build(scan.mesh)
    tables, views = [], []
    for place, photo in enumerate(capture.photos):
        light = capture.light(photo.light)
        view = view_surface(rays, inputs.camera_of(capture, scan, place))
        lighting = light_surface(rays, view, light)
        keep = trusted_pixels(view, lighting, Margins())
        radiance = inputs.radiance_of(capture, place)
        tables.append(sample_photo(view, lighting, light, radiance, keep))
        views.append(view)
    return SampleTable.join(tables), views
