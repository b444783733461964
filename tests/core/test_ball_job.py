"""The light of a photo from a ball in it: found alone, or with an outline moved by hand."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from patina.core.capture import read_capture
from patina.core.jobs.ball_job import BallJob, FoundBall
from tests import make_capture as made

RADIUS = 0.5  # of the ball: its whole outline is in the photo
PHOTO = 1  # lit at 60° from the view


@pytest.fixture(scope="module")
def ball(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A capture whose second photo shows a glossy ball before a grey wall."""
    path = made.make_capture(tmp_path_factory.mktemp("ball"))
    made.write_ball_photo(path.parent / f"lit_{PHOTO + 1}.exr", PHOTO, RADIUS)
    return path


def found(path: Path, outline: np.ndarray | None = None) -> FoundBall:
    job = BallJob(read_capture(path), PHOTO, outline, "glossy")
    job.drain()
    assert job.result is not None
    return job.result


def degrees_off(result: FoundBall) -> float:
    true = list(made.light_directions())[PHOTO]
    assert result.light is not None
    return float(np.degrees(np.arccos(min(float(result.light.direction @ true), 1.0))))


def test_ball_gives_the_direction(ball: Path) -> None:
    result = found(ball)
    assert degrees_off(result) < 2.0
    rotation, translation = list(made.poses())[PHOTO]
    centre = rotation @ made.CENTRE + translation
    ring = result.ring / np.linalg.norm(result.ring, axis=1, keepdims=True)
    angles = np.arccos(ring @ centre / np.linalg.norm(centre))
    half_pixel = 0.5 / made.FOCAL
    true = np.arcsin(RADIUS / np.linalg.norm(centre))
    assert np.allclose(angles, true, atol=1.6 * half_pixel)


def test_outline_near_the_ball_is_enough(ball: Path) -> None:
    """A circle 5 % beside the outline and 5 % too wide, at any distance from the camera."""
    ring = found(ball).ring
    middle = ring.mean(axis=0)
    wide = np.linalg.norm(ring - middle, axis=1).mean()
    moved = middle + 1.05 * (ring - middle) + np.array([0.05 * wide, 0.0, 0.0])
    assert degrees_off(found(ball, 7.0 * moved)) < 2.0


def test_without_a_ball_a_circle_is_offered(ball: Path) -> None:
    grey = np.full((made.HEIGHT, made.WIDTH, 3), 0.2)
    made.write_exr(ball.parent / f"lit_{PHOTO + 1}.exr", grey)
    result = found(ball)
    assert result.light is None
    assert np.allclose(result.ring[:, 2], 1.0) and np.ptp(result.ring[:, 0]) > 0.1
