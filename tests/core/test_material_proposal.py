"""Proposed material segmentation on spheres of known materials and on real stereo meshes of one
material.
"""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from patina.core.capture import read_capture
from patina.core.errors import FitError, InputError
from patina.core.masks.proposal import propose_materials
from patina.core.masks.proposal_cells import Cells
from patina.core.masks.proposal_job import ProposalJob
from patina.core.masks.proposal_surface import Surface, smooth_labels, without_islands
from patina.core.scan import Mesh
from tests import make_capture as made


def painted(paints, part):
    """A reflectance whose diffuse colour and Blinn lobe depend on the place on the unit sphere.
    paints: (albedo (3,), lobe strength, exponent) of each part; part: normals (n, 3) → part index
    (n,).
    """

    def brdf(normal, light, view):
        half = light + view
        half = half / np.linalg.norm(half, axis=-1, keepdims=True)
        cosine = np.maximum(np.sum(normal * half, axis=-1), 0.0)
        out = np.zeros_like(normal)
        which = part(normal)
        for number, (matte, lobe, exponent) in enumerate(paints):
            here = which == number
            out[here] = np.array(matte) + lobe * cosine[here, None] ** exponent
        return out

    return brdf


def caps(normal):
    """Three parts: two caps and the rest."""
    first = normal @ np.array([0.6, 0.0, 0.8]) > 0.45
    second = normal @ np.array([-0.48, 0.6, -0.64]) > 0.5
    return np.where(first, 1, np.where(second, 2, 0))


def halves(normal):
    """Two parts with a wavy border."""
    return (normal[:, 2] > 0.1 + 0.15 * np.sin(3 * np.arctan2(normal[:, 1], normal[:, 0]))) * 1


def run_proposal(path: Path, count: int | None = None):
    job = ProposalJob(read_capture(path), count)
    job.drain()
    assert job.result is not None
    return job.result


def truth(result, part) -> np.ndarray:
    corners = result.scan.mesh.vertices[result.scan.mesh.faces]
    centre = corners.mean(axis=1) - made.CENTRE
    return part(centre / np.linalg.norm(centre, axis=1, keepdims=True))


def accuracy(labels, true, where) -> float:
    """Share of correctly labelled faces; a label stands for the material of most of its faces."""
    right = 0
    names = []
    for label in np.unique(labels[where]):
        counts = np.bincount(true[where & (labels == label)])
        right += counts.max()
        names.append(counts.argmax())
    assert len(set(names)) == len(names), "two labels for one material"
    return right / where.sum()


@pytest.mark.parametrize("count", [None, 3])
def test_three_colours_are_separated(tmp_path: Path, count) -> None:
    paints = [
        ((0.16, 0.05, 0.04), 0.5, 60),
        ((0.05, 0.12, 0.05), 0.5, 60),
        ((0.2, 0.2, 0.2), 0.1, 9),
    ]
    path = made.make_capture(tmp_path, photos=9, brdf=painted(paints, caps))
    result = run_proposal(path, count)
    found = result.proposal
    assert found.count == 3
    seen = found.confidence > 0
    assert seen.mean() > 0.6  # faces are smaller than pixels
    true = truth(result, caps)
    assert accuracy(found.labels, true, seen) > 0.97
    areas = np.bincount(found.labels)
    assert (np.diff(areas) <= 0).all()  # the largest part first (the triangles have equal size)


def test_two_glosses_of_one_colour_are_separated(tmp_path: Path) -> None:
    paints = [((0.12, 0.09, 0.05), 0.0, 1), ((0.12, 0.09, 0.05), 0.35, 25)]
    path = made.make_capture(tmp_path, photos=9, brdf=painted(paints, halves))
    result = run_proposal(path)
    labels, true = result.proposal.labels, truth(result, halves)
    assert result.proposal.count == 2
    # where some photo has half vector and normal within 25° the lobe is visible; elsewhere the two
    # materials look the same, and a face can only follow its neighbours
    corners = result.scan.mesh.vertices[result.scan.mesh.faces].mean(axis=1) - made.CENTRE
    normal = corners / np.linalg.norm(corners, axis=1, keepdims=True)
    shows = np.zeros(len(true), bool)
    for (rotation, shift), light in zip(made.poses(9), made.light_directions(9), strict=True):
        view = -rotation.T @ shift - made.CENTRE - normal
        half = view / np.linalg.norm(view, axis=1, keepdims=True) + light
        half /= np.linalg.norm(half, axis=1, keepdims=True)
        lit = (normal @ light > 0.15) & (np.sum(normal * view, axis=1) > 0.5)
        shows |= lit & (np.sum(normal * half, axis=1) > np.cos(np.radians(25)))
    assert 0.2 < shows.mean() < 0.5
    assert accuracy(labels, true, shows) > 0.99
    assert accuracy(labels, true, np.ones(len(true), bool)) > 0.95


def test_light_and_dark_shades_of_one_colour_are_separated(tmp_path: Path) -> None:
    paints = [((0.20, 0.16, 0.12), 0.1, 20), ((0.10, 0.08, 0.06), 0.1, 20)]
    path = made.make_capture(tmp_path, photos=9, brdf=painted(paints, halves))
    result = run_proposal(path)
    assert result.proposal.count == 2
    seen = result.proposal.confidence > 0
    assert accuracy(result.proposal.labels, truth(result, halves), seen) > 0.97


@pytest.mark.parametrize("exponent", [4, 60, 400])
def test_single_material_is_not_split(tmp_path: Path, exponent: int) -> None:
    """On a mesh with normal errors such as those of a stereo mesh."""
    paint = [((0.16, 0.05, 0.04), 0.02 * exponent**0.8, exponent)]
    path = made.make_capture(tmp_path, brdf=painted(paint, lambda n: np.zeros(len(n), int)))
    vertices, faces = made.sphere_mesh(4)
    rng = np.random.default_rng(2)
    rough = made.CENTRE + (vertices - made.CENTRE) * (1 + rng.normal(0, 2e-3, (len(vertices), 1)))
    made.write_ply(tmp_path / "mesh.ply", rough, faces)
    found = run_proposal(path).proposal
    assert found.count == 1
    assert (found.labels == 0).all()


def test_unexplained_shadow_is_not_a_material(tmp_path: Path) -> None:
    """An occluder that is not in the scan darkens one region under one of the lamps."""
    import OpenImageIO as oiio

    path = made.make_capture(tmp_path, photos=6)
    file = str(tmp_path / "lit_1.exr")
    pixels = oiio.ImageBuf(file).get_pixels(oiio.FLOAT)[..., :3]
    bright = pixels.sum(axis=2) > 0.3 * pixels.sum(axis=2).max()
    _, columns = np.nonzero(bright)
    dark = (np.indices(bright.shape)[1] < np.median(columns)) & bright
    pixels[dark] *= 0.15  # some stray light remains
    made.write_exr(tmp_path / "lit_1.exr", pixels)
    assert run_proposal(path).proposal.count == 1


def test_requested_number_of_materials(tmp_path: Path) -> None:
    path = made.make_capture(tmp_path, photos=6)
    one = run_proposal(path, 1).proposal
    assert one.count == 1 and not one.splits
    assert run_proposal(path, 2).proposal.count <= 2


def test_capture_without_lit_surface_is_reported(tmp_path: Path) -> None:
    path = made.make_capture(tmp_path, photos=2)
    for i in (1, 2):
        made.write_exr(tmp_path / f"lit_{i}.exr", np.zeros((made.HEIGHT, made.WIDTH, 3)))
    with pytest.raises(InputError, match="lit"):
        run_proposal(path)


def test_empty_cells_are_reported() -> None:
    vertices, faces = made.sphere_mesh(2)
    k = 2
    none = Cells(
        *(np.zeros(0, np.int32),) * 2, np.zeros(0), np.zeros((0, 3)), np.zeros((0, k)),
        np.zeros(0), np.zeros((2, 0, k)), np.zeros((2, 0)), np.zeros(0),
    )  # fmt: skip
    with pytest.raises(FitError, match="lit"):
        propose_materials(none, Mesh(vertices, faces.astype(np.int32)))


def ball() -> Surface:
    vertices, faces = made.sphere_mesh(4)
    return Surface.of(Mesh(vertices, faces.astype(np.int32)))


def test_neighbouring_faces_share_an_edge() -> None:
    surface = ball()
    assert (surface.neighbours.sum(axis=1) == 3).all()
    assert np.isclose(surface.area.sum(), 1.0)


def test_patches_are_compact_and_near_requested_count() -> None:
    surface = ball()
    patch = surface.patches(200)
    count = patch.max() + 1
    assert 100 < count < 400
    centre = np.stack([np.bincount(patch, surface.centre[:, a]) for a in range(3)], axis=1)
    centre /= np.bincount(patch)[:, None]
    far = np.linalg.norm(surface.centre - centre[patch], axis=1)
    assert far.max() < 0.45  # a disc of 1/200 of the unit sphere has radius 0.14
    assert (surface.joined(patch).sum(axis=1) > 0).all()


def test_label_noise_is_smoothed_and_islands_are_removed() -> None:
    surface = ball()
    true = (surface.centre[:, 0] > made.CENTRE[0]).astype(int)
    rng = np.random.default_rng(0)
    likely = np.eye(2)[true] * 2.0 + rng.normal(0, 1.2, (len(true), 2))
    noisy = (likely.argmax(axis=1) == true).mean()
    smooth = smooth_labels(likely, surface.neighbours, 4.0)
    clean = without_islands(smooth, surface, 0.01)
    assert noisy < 0.9 < 0.97 < (clean == true).mean()
    island = np.where(np.arange(len(true)) == 7, 1 - true, true).astype(np.int32)
    assert np.array_equal(without_islands(island, surface, 0.01), true)


def test_demo_capture_matches_painted_masks(root: Path) -> None:
    """Glaze and clay of the embedded capture, compared with the masks painted for it."""
    from patina.core.geometry import view_surface
    from patina.core.inputs import capture_data
    from patina.core.inputs.material_pixels import material_pixels

    path = root / "assets" / "demo" / "demo.capture.toml"
    result = run_proposal(path)
    assert result.proposal.count == 2
    capture, right, all_of_them = read_capture(path), 0, 0
    for place in range(len(capture.photos)):
        camera = capture_data.camera_of(capture, result.scan, place)
        view = view_surface(result.rays, camera)
        where, _ = material_pixels(
            capture, result.scan, view, capture_data.photo_masks(capture, place)
        )
        label = result.proposal.labels[view.face]
        right += (where["glaze"] & (label == 0)).sum() + (where["clay"] & (label == 1)).sum()
        all_of_them += where["glaze"].sum() + where["clay"].sum()
    assert right / all_of_them > 0.99


@pytest.mark.slow
@pytest.mark.parametrize("name", ["bunny_red", "bunny_bronze", "bunny_fabric"])
def test_real_scans_of_one_material_are_not_split(shared: Path, name: str) -> None:
    found = run_proposal(shared / "data" / "scans" / name / "scan.capture.toml").proposal
    assert found.count == 1, found.splits
