"""The viewer's object with a material that varies, against the model of the variation in NumPy."""

from __future__ import annotations

import numpy as np
import pytest

from patina.core.angles import half_difference
from patina.core.appearance.principled import Principled
from patina.core.varying.node_model import GLOSS, SPECULAR, NodeModel
from patina.core.viewer import page as viewer_page
from patina.core.viewer.model_tables import ViewerMaterial
from patina.core.viewer.viewer_object import MARGIN, ViewerObject
from tests.browser import browser
from tests.browser.viewer_camera import EYE, LAMP, SIDE, averaged, rays
from tests.projected import projected
from tests.sphere_mesh import sphere

pytestmark = pytest.mark.slow

MODEL = Principled(base_color=np.array([0.4, 0.1, 0.05]), roughness=0.3)
PARAMETERS = np.zeros((1, 10), np.float32)
PARAMETERS[0, :3] = np.log([0.6, 1.5, 2.0])
PARAMETERS[0, SPECULAR], PARAMETERS[0, GLOSS] = np.log(0.7), np.log(1.4)


def factors(face, second, third):
    """ViewerObject's variation: the same at all points."""
    del second, third
    row = [*np.exp(PARAMETERS[0, :3]), *[0.7] * 3, 1.4, 0, 0, 0]
    return np.tile(row, (len(face), 1))


def drawn(folder, brdf, node_model) -> np.ndarray:
    """(SIDE, SIDE, 4) the mean of the viewer's pictures, row 0 on top."""
    points, faces = sphere(150)
    even = np.zeros(len(faces), int)
    thing = ViewerObject.of(points, faces, even, variation=factors)
    red, green, blue = node_model.body.tolist()
    material = ViewerMaterial.of("painted", brdf, {}, body=(red, green, blue))
    file = folder / "viewer.html"
    viewer_page.write_viewer(file, "A painted sphere", [material], [], thing)
    with browser.opened(file, (600, 400)) as (page, errors):
        found = averaged(page, 100)
        assert errors == []
    return found


def expected(node_model) -> tuple[np.ndarray, np.ndarray]:
    """(radiance (SIDE, SIDE, 3), pixels inside the sphere and lit) at the pixels' centres."""
    ray = rays()
    radius = 1 / MARGIN
    along = -ray @ EYE
    miss = EYE @ EYE - along**2
    inside = miss < (0.95 * radius) ** 2
    far = along - np.sqrt(np.maximum(radius**2 - miss, 0))
    normal = (EYE + far[..., None] * ray) / radius
    cosine = normal @ LAMP
    kept = inside & (cosine > 0.15)
    n = normal[kept]
    angles = half_difference(n, np.broadcast_to(LAMP, n.shape), -ray[kept])
    rho = node_model.reflectance(angles, np.repeat(PARAMETERS, len(n), axis=0))
    out = np.zeros((SIDE, SIDE, 3))
    out[kept] = np.pi * rho * cosine[kept][:, None]
    return out, kept


def test_the_viewer_evaluates_the_variation(tmp_path):
    browser.program()
    brdf = projected(MODEL.evaluate, 60)
    node_model = NodeModel.of(brdf)
    true, kept = expected(node_model)
    found = drawn(tmp_path, brdf, node_model)[..., :3]
    error = np.sqrt(np.sum((found - true)[kept] ** 2) / np.sum(true[kept] ** 2))
    print(f"varied sphere: relative RMS {100 * error:.2f} %")
    assert error < 0.02
