"""Lamps at a finite distance that stand elsewhere than stated, and lifted blacks: photos are
computed from the true positions, without the diagnosis' forward model."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from patina.core.basis import PrincipalBRDF, default_basis
from patina.core.concurrency.steps import drained
from patina.core.diagnose.effects.black_level import BlackLevel
from patina.core.diagnose.effects.camera_response import CameraResponse
from patina.core.diagnose.effects.flash_offset import FlashOffset
from patina.core.diagnose.effects.lamp_position import LampPosition
from patina.core.diagnose.effects.light_intensity import LightIntensity
from patina.core.diagnose.effects.near_light import NearLight
from patina.core.diagnose.effects.vignetting import Vignetting
from patina.core.diagnose.forward.diagnosis_context import DiagnosisContext
from patina.core.diagnose.forward.material_brdfs import MaterialBRDFs
from patina.core.diagnose.forward.rig import Rig
from patina.core.diagnose.forward.shading_state import ShadingState
from patina.core.diagnose.selection.search import search
from tests.make_lit_ball import NOISE, PHOTOS, SIZE, changed, lit_ball

DISTANCE = 6.0  # of the lamps from the centre, scan units
OTHERS = (LightIntensity, CameraResponse, Vignetting, BlackLevel)


def photographed(context: DiagnosisContext, lamp: np.ndarray, seed: int) -> np.ndarray:
    """(n, 3) radiance of the ball under lamps at positions (photos, 3), irradiance π at the
    centre."""
    pixels = context.pixels
    towards = lamp[pixels.photo] - pixels.point
    far = np.linalg.norm(towards, axis=1, keepdims=True)
    towards = (towards / far).astype(np.float32)
    material = MaterialBRDFs.of([PrincipalBRDF(default_basis(), default_basis().training[30:33])])
    angles = replace(ShadingState.of(pixels), light=towards).angles
    cosine = np.maximum(np.sum(pixels.normal * towards, axis=1, keepdims=True), 0)
    centre = np.sum(lamp[pixels.photo] ** 2, axis=1, keepdims=True)
    radiance = material.evaluate(angles, pixels.material) * np.pi * centre / far**2 * cosine
    return radiance * (1 + NOISE * np.random.default_rng(seed).standard_normal(radiance.shape))


def under_lamps(context: DiagnosisContext, rig: Rig) -> DiagnosisContext:
    """The ball under the lamps of a rig, as the capture states them."""
    pixels = context.pixels
    towards = rig.lamp[pixels.photo] - pixels.point
    far = np.linalg.norm(towards, axis=1, keepdims=True)
    centre = np.sum(rig.lamp[pixels.photo] ** 2, axis=1, keepdims=True)
    light = (towards / far).astype(np.float32)
    visible = (np.sum(pixels.normal * light, axis=1) > 0).astype(np.float32)
    irradiance = np.broadcast_to(np.pi * centre / far**2, (len(pixels), 3)).astype(np.float32)
    pixels = replace(pixels, light=light, irradiance=irradiance, visible=visible)
    distant = np.zeros(len(context.lights), bool)
    return replace(context, pixels=pixels, rig=rig, distant=distant)


def one_light(context: DiagnosisContext) -> DiagnosisContext:
    return replace(context, light=np.zeros(PHOTOS, int), lights=("flash",))


@pytest.mark.parametrize(("nearness", "named"), [(0.0, False), (0.02, False), (0.06, True)])
def test_a_lamp_that_lights_the_object_evenly_is_not_near(nearness: float, named: bool) -> None:
    effect = NearLight.of(lit_ball(1))
    assert effect is not None
    x = np.zeros(len(effect.parameters))
    x[::4], x[1::4] = nearness, 0.05
    assert effect.is_relevant(x) == named


@pytest.fixture(scope="module")
def near_ball() -> NearLight:
    effect = NearLight.of(lit_ball(1))
    assert effect is not None
    return effect


PLACE = st.tuples(*[st.floats(-1.0, 1.0)] * 3)


@given(st.floats(0.04, 0.8), PLACE, st.integers(0, 2**31))
def test_a_lamp_measured_anywhere_on_the_object_is_possible(near_ball, nearness, place, seed):
    """The stated direction and irradiance are those at a place on the object, not at its centre."""
    effect = near_ball
    place = 0.5 * np.array(place) / max(np.linalg.norm(place), 1.0)  # sizes from the centre
    towards = np.random.default_rng(seed).normal(size=3)
    lamp = towards / np.linalg.norm(towards) / nearness
    away = lamp - place
    angle = np.arccos(min(1.0, lamp @ away / np.linalg.norm(lamp) / np.linalg.norm(away)))
    x = np.zeros(len(effect.parameters))
    x[::4], x[1::4] = nearness, angle
    x[3::4] = 2 * np.log(np.linalg.norm(away) / np.linalg.norm(lamp))
    assert effect.is_relevant(x)


@pytest.mark.parametrize(("place", "size"), [(1, 0.3), (3, 0.4), (3, -0.4)])
def test_a_lamp_that_was_measured_nowhere_on_the_object_is_not_near(near_ball, place, size):
    """One lamp is 17° elsewhere, or its brightness off by 40 %, though it is 10 sizes away."""
    effect = near_ball
    x = np.zeros(len(effect.parameters))
    x[::4] = 0.1
    assert effect.is_relevant(x)
    x[place] = size
    assert not effect.is_relevant(x)


def test_a_flash_beside_the_lens_is_found_with_its_place():
    """Six cameras around the ball; the flash is stated at the lens."""
    context = one_light(lit_ball(3))
    pixels = context.pixels
    axes, lens = np.zeros((PHOTOS, 3, 3)), np.zeros((PHOTOS, 3))
    for photo in range(PHOTOS):
        view = pixels.view[pixels.photo == photo].mean(axis=0)
        forward = -view / np.linalg.norm(view)
        right = np.cross([0.0, 0.0, 1.0], forward)
        right /= np.linalg.norm(right)
        axes[photo] = right, np.cross(forward, right), forward
        lens[photo] = -DISTANCE * forward
    offset = np.array([0.3, -0.6, 0.0])
    true = lens + np.einsum("a,pax->px", offset, axes)
    stated = under_lamps(context, Rig(axes, lens, np.ones(PHOTOS, bool)))
    stated = changed(stated, photographed(context, true, 4))
    effects = [kind.of(stated) for kind in (FlashOffset, *OTHERS)]
    found = drained(search(stated, np.radians(0.2), effects))
    assert found.causes[0] == "flash_offset" and not found.accepted[0].ties
    trial = found.accepted[0]
    assert trial.x[:2] == pytest.approx(offset[:2], abs=0.1)
    assert (np.abs(trial.x - offset) < 4 * trial.standard_errors).all()
    assert "to the right" in found.sentence(trial) and " up" in found.sentence(trial)


def test_near_lamps_that_stand_nearer_are_found():
    context = lit_ball(3)
    towards = np.stack(
        [context.pixels.light[np.flatnonzero(context.pixels.photo == p)[0]] for p in range(PHOTOS)]
    )
    lamp = 4.0 * SIZE * towards.astype(np.float64)
    stated = under_lamps(context, Rig(np.stack([np.eye(3)] * PHOTOS), lamp, np.zeros(PHOTOS, bool)))
    stated = changed(stated, photographed(context, 0.8 * lamp, 5))
    assert NearLight.of(stated) is None and FlashOffset.of(stated) is None
    effects = [kind.of(stated) for kind in (LampPosition, *OTHERS)]
    found = drained(search(stated, np.radians(0.2), effects))
    assert found.causes == ("near_light",)
    assert found.accepted[0].x[::4] == pytest.approx(0.2, abs=0.03)


def test_lifted_blacks_are_found_with_their_level():
    context = lit_ball(6)
    level = np.array([0.004, 0.004, 0.004])
    lifted = changed(context, context.pixels.observed + level)
    effects = [kind.of(lifted) for kind in OTHERS]
    found = drained(search(lifted, np.radians(0.2), effects))
    assert found.causes == ("black_level",)
    trial = found.accepted[0]
    assert isinstance(trial.effect, BlackLevel)
    assert trial.effect.white * trial.x == pytest.approx(level, abs=4e-4)
