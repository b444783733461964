"""Materials under lights of unknown irradiance share one scale."""

from __future__ import annotations

import numpy as np
import pytest

from patina.core.angles import Angles
from patina.core.capture import read_capture
from patina.core.jobs import FitJob, finished
from tests import make_capture as made

RATIO = 6.0  # of the reflectance of the two materials
AWAY = Angles(*(np.array([angle], np.float32) for angle in (0.9, 0.2, 1.5)))  # from the highlight


def halves(normal, light, view):
    """A bright and a dark matt half, 1/sr."""
    bright = np.where(normal[..., :1] > 0, 0.2, 0.2 / RATIO)
    return bright + made.blinn(normal, light, view) - np.array([0.16, 0.05, 0.04])


@pytest.mark.slow
def test_dark_material_stays_darker_than_a_bright_one(tmp_path):
    extra = "[fit]\nheld_out = false\nabsolute = false\n" + "".join(
        f'[[material]]\nname = "{name}"\nfaces = "part"\n' for name in ("dark", "bright")
    )
    path = made.make_capture(tmp_path, photos=8, brdf=halves, extra=extra)
    vertices, faces = made.sphere_mesh()
    bright = vertices[faces].mean(axis=1)[:, 0] > made.CENTRE[0]
    made.write_ply(tmp_path / "mesh.ply", vertices, faces, face_attribute=bright.astype(int))
    job = FitJob(read_capture(path), portable=False)
    job.drain()
    dark, light = finished(job.result).materials
    assert dark.scale == light.scale and not dark.irradiance_known
    albedo = [m.fit.brdf.evaluate(AWAY).mean() for m in (dark, light)]
    assert albedo[1] / albedo[0] == pytest.approx(RATIO, rel=0.15)
