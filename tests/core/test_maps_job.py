"""Texture maps of a capture without Blender: a sphere whose colour depends on the normal."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from patina.core.angles import Angles
from patina.core.capture import read_capture
from patina.core.errors import InputError
from patina.core.jobs import FitJob
from patina.core.maps import MapsJob, MapsSettings
from patina.core.maps.level import MaterialLevel
from patina.core.maps.normals import corner_tangents
from patina.core.maps.write import albedo, base_color, describe, write_maps
from patina.core.report import result_json
from patina.core.result import read_result
from patina.core.scan import Mesh
from tests import make_capture as made

DIFFUSE_BRDF = np.array([0.16, 0.05, 0.04])  # 1/sr, of the material that make_capture uses


def paint(normal):
    """Factor (n, 3) on the diffuse albedo of a painted sphere: bands around three axes."""
    return 1 + 0.45 * np.sin(5 * normal)


def painted(normal, light, view):
    return made.blinn(normal, light, view) + DIFFUSE_BRDF * (paint(normal) - 1)


def sphere_uv(mesh):
    """(f, 3, 2) longitude and latitude of a sphere's faces, continuous across the seam."""
    n = (mesh.vertices - made.CENTRE)[mesh.faces]
    n = n / np.linalg.norm(n, axis=2, keepdims=True)
    u = np.arctan2(n[..., 1], n[..., 0]) / (2 * np.pi) + 0.5
    u = np.where((np.ptp(u, axis=1) > 0.5)[:, None] & (u < 0.5), u + 1, u)
    return np.stack([u, np.arccos(np.clip(n[..., 2], -1, 1)) / np.pi], axis=-1).astype(np.float32)


def fitted(folder, brdf, waves=0.0):
    """Return (capture, its result); waves: amplitude of waves that the mesh has and the photos
    lack.
    """
    file = made.make_capture(folder, photos=9, brdf=brdf)
    if waves:
        vertices, faces = made.sphere_mesh()
        normal = vertices - made.CENTRE
        height = waves * np.sin(9 * normal).sum(axis=1, keepdims=True)
        made.write_ply(folder / "mesh.ply", vertices + height * normal, faces)
    capture = read_capture(file)
    job = FitJob(capture)
    job.drain()
    (folder / "fit").mkdir()
    result_json.write(folder / "fit" / "result.json", job.result, job.stages, ())
    return capture, read_result(folder / "fit")


def run_maps_job(capture, result, size=128, refits=1, unwrap=sphere_uv):
    job = MapsJob(capture, result, MapsSettings(size, refits), unwrap)
    job.drain()
    return job.result


@pytest.fixture(scope="module")
def banded(tmp_path_factory):
    capture, result = fitted(tmp_path_factory.mktemp("banded"), painted)
    return capture, result, run_maps_job(capture, result, refits=3)


def true_albedo(found):
    normal = found.texels.points(found.scan.mesh, slice(None)) - made.CENTRE
    normal /= np.linalg.norm(normal, axis=1, keepdims=True)
    return np.pi * DIFFUSE_BRDF * paint(normal)


@pytest.mark.slow
def test_albedo_map_matches_painted_albedo(banded):
    _, _, found = banded
    expected, known = true_albedo(found), albedo(found, 0)
    well = (found.maps.photos >= 2) & (found.maps.error < 0.1)
    assert well.mean() > 0.15
    error = np.sqrt(np.mean((known[well] - expected[well]) ** 2) / np.mean(expected[well] ** 2))
    print(f"albedo {error:.4f}")
    assert error < 0.06
    assert found.refit is not None


@pytest.mark.slow
def test_uniform_surface_stays_uniform_and_is_not_refitted(tmp_path):
    capture, result = fitted(tmp_path, made.blinn)
    found = run_maps_job(capture, result)
    assert found.refit is None
    seen = (found.maps.photos > 0) & (found.maps.error < 0.1)
    assert seen.mean() > 0.4
    grey = found.maps.materials[0].scale[seen].mean(axis=1)
    assert np.std(grey) < 0.05 and abs(np.median(grey) - 1) < 0.05


@pytest.mark.slow
def test_written_maps_describe_themselves(banded, tmp_path):
    _, _, found = banded
    files = write_maps(tmp_path, found, "png")
    assert all((tmp_path / f.file).is_file() for f in files)
    reported = describe(found, files)
    assert reported["texels"] == len(found.texels) and reported["unwrapped"]
    assert 0 < reported["seen"] <= 1 and reported["standard_error"]["median"] < 0.2
    assert np.all(base_color(found, 0) <= 1) and np.all(base_color(found, 0) >= 0)
    import OpenImageIO as oiio

    image = np.array(oiio.ImageBuf(str(tmp_path / "surface_albedo.png")).get_pixels(oiio.FLOAT))
    code = image.reshape(-1, 3)[found.texels.place]
    linear = np.where(code <= 0.04045, code / 12.92, ((code + 0.055) / 1.055) ** 2.4)
    assert np.abs(linear - albedo(found, 0)).max() < 0.006  # 8 bits of sRGB


@pytest.mark.slow
def test_mesh_without_texture_coordinates_outside_blender(banded):
    capture, result, _ = banded
    with pytest.raises(InputError, match=r"no texture coordinates.*unwrap"):
        run_maps_job(capture, result, unwrap=None)


@pytest.mark.slow
def test_photos_without_lit_pixels_raise_capture_error(banded):
    capture, result, _ = banded
    away = [rotation.T @ np.array([0.0, 0.0, 1.0]) for rotation, _ in made.poses(9)]
    lights = tuple(replace(a, direction=d) for a, d in zip(capture.lights, away, strict=True))
    with pytest.raises(InputError, match="no texel is seen lit"):
        run_maps_job(replace(capture, lights=lights), result)


@pytest.mark.slow
def test_normal_map_corrects_mesh_normals_towards_true_surface(tmp_path):
    capture, result = fitted(tmp_path, made.blinn, waves=0.004)
    settings = MapsSettings(128, 0, normal=True)
    job = MapsJob(capture, result, settings, sphere_uv)
    job.drain()
    found = job.result
    mesh, texels = found.scan.mesh, found.texels
    corner, tangents, sign = corner_tangents(mesh)
    normal = texels.normals(mesh, slice(None))
    # back from the tangent frame, as a renderer does it
    tangent = tangents[corner[texels.face, 0]]
    tangent = tangent - np.einsum("nc,nc->n", tangent, normal)[:, None] * normal
    tangent /= np.linalg.norm(tangent, axis=1, keepdims=True)
    other = sign[texels.face, None] * np.cross(normal, tangent)
    x, y, z = (found.normal[:, k : k + 1] for k in range(3))
    turned = x * tangent + y * other + z * normal
    exact = texels.points(mesh, slice(None)) - made.CENTRE
    exact /= np.linalg.norm(exact, axis=1, keepdims=True)

    def angular_error(values):
        return np.degrees(np.arccos(np.clip(np.einsum("nc,nc->n", values, exact), -1, 1)))

    # tangents at face corners turn fast near the poles
    well_conditioned = np.abs(exact[:, 2]) < 0.9
    seen = well_conditioned & (found.maps.photos >= 2)
    before, after = np.median(angular_error(normal)[seen]), np.median(angular_error(turned)[seen])
    print(f"normals {before:.2f}° before, {after:.2f}° after")
    assert before > 1.0 and after < 0.75 * before
    unobserved = well_conditioned & (found.maps.photos == 0)
    assert np.median(angular_error(turned)[unobserved]) < 1.15 * np.median(
        angular_error(normal)[unobserved]
    )


def test_tangents_follow_u_on_plain_and_mirrored_faces():
    points = np.array([[0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 1, 0.0]])
    faces = np.array([[0, 1, 2], [0, 2, 3]], np.int32)
    uv = np.array([[[0, 0], [0, 1], [1, 1]], [[0, 0], [1, 1], [1, 0]]], np.float32)  # u along y
    corner, tangents, sign = corner_tangents(Mesh(points, faces, uv=uv))
    assert np.allclose(tangents[corner], [0, 1, 0]) and (sign == -1).all()
    corner, tangents, sign = corner_tangents(Mesh(points, faces, uv=uv[..., ::-1].copy()))
    assert np.allclose(tangents[corner], [1, 0, 0]) and (sign == 1).all()


def ggx(alpha):
    def evaluate(angles: Angles):
        c2 = np.cos(angles.theta_h) ** 2
        lobe = 0.05 * alpha**2 / (np.pi * (c2 * (alpha**2 - 1) + 1) ** 2)
        return (0.1 + lobe)[:, None] * np.ones(3)

    return evaluate


class KnownBRDF:
    """Stands in for a fitted BRDF."""

    def __init__(self, evaluate):
        self.evaluate = evaluate


def test_gloss_derivative_matches_change_of_roughness():
    theta_h = np.radians(np.array([0.5, 3.0, 6.0, 10.0, 16.0]))
    angles = Angles(theta_h, np.full(5, 0.4), np.full(5, 1.0))
    level = MaterialLevel.of("x", KnownBRDF(ggx(0.12)))
    part = level.at(angles)
    small = 0.02
    expected = (ggx(0.12 * np.exp(small))(angles) - ggx(0.12)(angles))[:, 0] / small
    assert np.abs(part.gloss - expected).max() < 0.2 * np.abs(expected).max()
    assert part.gloss[0] < 0 < part.gloss[-1]
    assert np.allclose(part.body + part.specular, level.brdf.evaluate(angles))
