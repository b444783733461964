"""The proposed photo: its expected gain against that of a fit with it, and what it may be."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from patina.core.angles import Angles
from patina.core.basis import default_basis
from patina.core.fit.measured import fit_measured
from patina.core.fit.measured_result import MeasuredResult
from patina.core.geometry import RayScene, view_surface
from patina.core.light import DistantLight, Light, MountedLight
from patina.core.proposed_photo import (
    DirectionUncertainty,
    MaterialToPhotograph,
    ProposedPhoto,
    propose,
    regions,
)
from patina.core.proposed_photo.candidates import (
    LAMPS,
    SurfacePoints,
    chosen_cameras,
    directions_to,
    in_picture,
    lamp_directions,
    lit_from,
    moves_with_camera,
    seen_from,
)
from patina.core.samples import Margins, SampleTable, sample_photo
from patina.core.samples.take import light_surface, trusted_pixels
from patina.core.scan import Camera, Mesh
from patina.core.scan.camera import Pose
from tests import make_capture as made

BALL = Mesh(*made.sphere_mesh(4))


def camera(label: str, eye: Sequence[float]) -> Camera:
    """A camera that looks at the ball."""
    rotation, translation = made.look_at(made.CENTRE + eye, made.CENTRE)
    lens = (260.0, 260.0, 80.0, 80.0)
    return Camera(label, 160, 160, "PINHOLE", lens, Pose(rotation, translation))


HEIGHTS = (0.3, 0.6, 0.2, 0.7, 0.4, 0.5)
CAMERAS = [
    camera(f"view_{i}", [4 * np.cos(0.9 * i), 4 * np.sin(0.9 * i), 4 * height])
    for i, height in enumerate(HEIGHTS)
]


def lamp(towards: np.ndarray) -> DistantLight:
    return DistantLight("lamp", towards / np.linalg.norm(towards), np.full(3, np.pi))


def photographed(camera: Camera, light: Light, rays: RayScene) -> SampleTable:
    """The samples of a glossy ball (Blinn, not of the basis) in a photo without noise."""
    view = view_surface(rays, camera)
    lighting = light_surface(rays, view, light, camera)
    keep = trusted_pixels(view, lighting, Margins())
    black = np.zeros((camera.height * camera.width, 3), np.float32)
    table = sample_photo(view, lighting, black, keep)
    rho = made.blinn(table.normal, table.light, table.view).astype(np.float32)
    radiance = rho * table.irradiance * table.cos_i[:, None]
    values = {key: getattr(table, key) for key in vars(table)}
    return SampleTable(**{**values, "rho": rho, "radiance": radiance})


@pytest.fixture(scope="module")
def rays() -> RayScene:
    return RayScene.build(BALL)


@pytest.fixture(scope="module")
def shots() -> list[tuple[Camera, DistantLight]]:
    """Four photos with lamps beside the camera, 20° to 40° from it."""
    beside = np.array([[0.4, 0.1, 0.3], [-0.3, 0.4, 0.2], [0.1, 0.3, 0.5], [0.2, -0.4, 0.1]])
    return [
        (camera, lamp((camera.pose.centre - made.CENTRE) / 4 + side))
        for camera, side in zip(CAMERAS[:4], beside, strict=True)
    ]


def points_of_ball() -> SurfacePoints:
    found = SurfacePoints.of(BALL, np.arange(len(BALL.faces)))
    assert found is not None
    return found


def fitted(rays: RayScene, shots: Sequence[tuple[Camera, Light]]) -> MeasuredResult:
    tables = [photographed(camera, light, rays) for camera, light in shots]
    return MeasuredResult.of(fit_measured(SampleTable.join(tables), default_basis()))


@pytest.fixture(scope="module")
def fit(rays: RayScene, shots: list[tuple[Camera, DistantLight]]) -> MeasuredResult:
    return fitted(rays, shots)


@pytest.fixture(scope="module")
def material(fit: MeasuredResult) -> MaterialToPhotograph:
    surface = points_of_ball()
    return MaterialToPhotograph(surface, DirectionUncertainty.of(fit))


def test_expected_uncertainty_is_that_of_a_fit_with_the_photo(
    rays: RayScene,
    shots: list[tuple[Camera, DistantLight]],
    material: MaterialToPhotograph,
) -> None:
    found = propose(rays, CAMERAS, [light for _, light in shots], [material])
    assert found is not None and found.towards is not None
    assert found.angle > 90, "four photos with lamps beside the camera do not show grazing angles"
    assert found.before == pytest.approx(material.uncertainty.deviation())
    taken = next(camera for camera in CAMERAS if camera.label == found.camera)
    after = fitted(rays, [*shots, (taken, lamp(found.towards))])
    achieved = DirectionUncertainty.of(after).deviation()
    # a fit with the photo also learns how far the material is from the measured ones
    assert 0.6 * found.after < achieved < 1.1 * found.after
    assert found.after < 0.9 * found.before


def test_proposed_photo_gains_more_than_a_repeated_one(
    rays: RayScene,
    shots: list[tuple[Camera, DistantLight]],
    fit: MeasuredResult,
    material: MaterialToPhotograph,
) -> None:
    found = propose(rays, CAMERAS, [light for _, light in shots], [material])
    assert found is not None
    again = fitted(rays, [*shots, shots[0]])
    repeated = DirectionUncertainty.of(again).deviation()
    assert found.after < 0.9 * repeated


def test_photo_of_nothing_new_changes_nothing(material: MaterialToPhotograph) -> None:
    none = np.zeros((1, regions.COUNT), np.intp)
    before = material.uncertainty.deviation()
    assert material.uncertainty.variance_after(none)[0] == pytest.approx(before**2)


@settings(deadline=None, max_examples=20)
@given(seed=st.integers(0, 10**6))
def test_more_directions_never_increase_the_uncertainty(
    material: MaterialToPhotograph, seed: int
) -> None:
    rng = np.random.default_rng(seed)
    more = np.where(rng.random(regions.COUNT) < 0.3, 9, 0)
    # of the same parts of each region, so that no observation moves from one part to another
    whole = rng.random(regions.ROWS * regions.COLUMNS) < 0.5
    fewer = np.where(whole[regions.region_of_part()], more, 0)
    less, all_of_them = material.uncertainty.variance_after(np.stack([fewer, more]))
    assert all_of_them <= less * (1 + 1e-9)


@pytest.fixture(scope="module")
def of_one_photo(rays: RayScene) -> MaterialToPhotograph:
    """A material that one photo shows, with the lamp at the side: a flash would show more."""
    aside = np.cross(CAMERAS[0].pose.centre - made.CENTRE, [0.0, 0.0, 1.0])
    fit = fitted(rays, [(CAMERAS[0], lamp(aside))])
    return MaterialToPhotograph(points_of_ball(), DirectionUncertainty.of(fit))


def test_flash_stays_on_its_camera(rays: RayScene, of_one_photo: MaterialToPhotograph) -> None:
    flash = MountedLight("flash", np.array([0.1, 0.0, 0.0]), np.ones(3))
    assert moves_with_camera([flash]) is flash
    found = propose(rays, CAMERAS, [flash], [of_one_photo])
    assert found is not None
    assert found.towards is None and "with the flash" in found.sentence


def test_surface_behind_the_camera_hides_nothing(of_one_photo: MaterialToPhotograph) -> None:
    """A scan of a room has walls behind the camera and behind a flash."""
    vertices, faces = made.sphere_mesh(3)
    room = made.CENTRE + 8.0 * (vertices - made.CENTRE)
    both = (
        np.concatenate([BALL.vertices, room]),
        np.concatenate([BALL.faces, faces + len(BALL.vertices)]),
    )
    inside = RayScene.build(Mesh(*both))
    seen = seen_from(inside, of_one_photo.surface, CAMERAS[0])
    assert seen.sum() > 200
    flash = MountedLight("flash", np.array([0.1, 0.0, 0.0]), np.ones(3))
    assert propose(inside, CAMERAS, [flash], [of_one_photo]) is not None


@pytest.mark.parametrize("count", [1, 3])
def test_lamps_stand_all_around_where_cameras_do_not_tell_where_up_is(count: int) -> None:
    front = [camera(f"front_{i}", [4.0, 0.4 * i, 0.5]) for i in range(count)]
    lamps = lamp_directions(front, made.CENTRE)
    assert len(lamps) == LAMPS


def test_lamps_are_not_below_cameras_that_stand_around_the_object() -> None:
    lamps = lamp_directions(CAMERAS, made.CENTRE)
    assert 0.4 * LAMPS < len(lamps) < 0.7 * LAMPS
    assert lamps[:, 2].min() > -0.5 and lamps[:, 2].max() > 0.9


def test_orthographic_camera_is_judged_by_its_direction() -> None:
    """The position of an orthographic camera along its axis has no meaning."""
    turn = np.diag([1.0, -1.0, -1.0])
    for depth in (4.0, -4.0):
        pose = Pose(turn, np.array([0.0, 0.0, depth]))
        one = Camera("ortho", 160, 160, "ORTHOGRAPHIC", (40.0, 40.0, 80.0, 80.0), pose)
        assert np.allclose(directions_to(one, made.CENTRE[None]), [[0.0, 0.0, 1.0]])


def test_faces_without_area_have_no_points() -> None:
    flat = Mesh(np.zeros((3, 3)), np.array([[0, 1, 2]]))
    assert SurfacePoints.of(flat, np.arange(1)) is None


def test_lamp_in_the_picture_is_not_proposed() -> None:
    view = CAMERAS[0]
    away = view.pose.rotation[2]
    lamps = np.stack([away, -away, np.cross(away, [0.0, 0.0, 1.0])])
    assert in_picture(view, lamps).tolist() == [True, False, False]


def test_points_behind_the_ball_are_not_lit(rays: RayScene) -> None:
    surface = points_of_ball()
    towards = np.broadcast_to([0.0, 0.0, 1.0], surface.point.shape)
    lit = lit_from(rays, surface, towards)
    assert lit.sum() > 100
    assert surface.normal[lit, 2].min() > 0.15


def test_points_are_uniform_over_the_area() -> None:
    surface = points_of_ball()
    point = surface.point - made.CENTRE
    assert np.abs(point.mean(axis=0)).max() < 0.06
    assert np.abs((point**2).mean(axis=0) - 1 / 3).max() < 0.04
    assert np.allclose(np.linalg.norm(surface.normal, axis=1), 1.0)


def test_chosen_cameras_are_far_apart() -> None:
    near = [camera(f"copy_{i}", [4.0, 0.001 * i, 1.2]) for i in range(60)]
    chosen = chosen_cameras([*near, *CAMERAS], made.CENTRE)
    assert {c.label for c in CAMERAS[1:]} <= {c.label for c in chosen}


@pytest.mark.parametrize(
    ("towards", "words"),
    [
        ([1.0, 0.0, 0.0], "at the right of the photo, 90° from the camera"),
        ([0.0, 0.7, 0.714], "at the top of the photo, 44° from the camera"),
        ([-0.7, -0.7, -0.1], "behind the object, at the lower left of the photo"),
        ([0.0, 0.0, 1.0], "next to the camera"),
        ([0.1, 0.0, -1.0], "opposite the camera"),
    ],
)
def test_sentence_says_where_the_lamp_is(towards: list[float], words: str) -> None:
    # right, up and towards the viewer: x, y and z; the camera's own y is down, its z forward
    seen = Camera(
        "IMG_1", 160, 160, "PINHOLE", (260.0, 260.0, 80.0, 80.0),
        Pose(np.diag([1.0, -1.0, -1.0]), np.array([0.0, 0.0, 4.0])),
    )  # fmt: skip
    direction = np.array(towards) / np.linalg.norm(towards)
    found = ProposedPhoto.of(seen, np.zeros(3), direction, 0.2, 0.15)
    assert words in found.sentence and "IMG_1" in found.sentence
    assert "decreases by 25 %" in found.sentence


def test_part_of_every_direction_is_in_range() -> None:
    rng = np.random.default_rng(0)
    high = np.pi / 2 * np.array([[1.0], [1.0], [4.0]])
    part = regions.part_of(Angles(*(rng.random((3, 2000)) * high)))
    assert part.min() >= 0 and part.max() < regions.COUNT
    own = regions.part_of(regions.centres())
    assert own.tolist() == list(range(regions.COUNT)), "each centre is in its own part"
