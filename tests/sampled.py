"""The samples of a capture as the fit job takes them, of one or of all materials."""

from __future__ import annotations

from pathlib import Path

from patina.core.capture import read_capture
from patina.core.concurrency.steps import drained
from patina.core.geometry import RayScene, SurfaceView, view_surface
from patina.core.inputs import capture_data
from patina.core.inputs.lights import find_lights
from patina.core.inputs.photos import LitPhotos
from patina.core.jobs.sampling import take_samples
from patina.core.samples import Margins, SampleTable, sample_photo
from patina.core.samples.take import light_surface, trusted_pixels


def sampled(path: Path) -> tuple[SampleTable, list[SurfaceView]]:
    """Return (all samples, one view per photo)."""
    capture = read_capture(path)
    scan = capture_data.open_scan(capture)
    rays = RayScene.build(scan.mesh)
    photos = LitPhotos.open(capture)
    lights = find_lights(capture, scan, photos)
    tables, views = [], []
    for place in range(len(capture.photos)):
        light = lights.of(capture, place)
        camera = capture_data.camera_of(capture, scan, place)
        view = view_surface(rays, camera)
        lighting = light_surface(rays, view, light, camera)
        keep = trusted_pixels(view, lighting, Margins())
        photo = photos.read_with_noise(place)
        tables.append(sample_photo(view, lighting, photo.radiance, keep, noise=photo.noise))
        views.append(view)
    return SampleTable.join(tables), views


def sampled_materials(path: Path) -> dict[str, SampleTable]:
    """Return material name → all samples."""
    capture = read_capture(path)
    scan = capture_data.open_scan(capture)
    rays = RayScene.build(scan.mesh)
    photos = LitPhotos.open(capture)
    lights = find_lights(capture, scan, photos)
    taken = drained(take_samples(capture, scan, rays, photos, lights))
    return {material.name: taken.kept[material.name].table() for material in capture.materials}
