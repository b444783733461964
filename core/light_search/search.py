"""Find the direction, position or offset of lights from the photos that they lit.

1. Coarse: for each lamp, candidates over all directions (or offsets); each candidate explains the
   lamp's own photos by a material of its own.
2. Shared: all lamps of a capture light the same materials. Lamps and materials are chosen
   alternately, starting from the material of each lamp in turn.
3. Fine: the cost is minimised over the parameters of each lamp (Nelder & Mead 1965) with more
   pixels, alternating with the materials.
Shading, highlights and cast shadows on the scanned mesh all enter the cost (log_cost.py).
"""

from __future__ import annotations

from collections.abc import Generator, Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from ..concurrency.steps import scaled
from ..errors import PatinaError
from ..geometry import RayScene
from ..light import DistantLight, Light
from .brdf_dictionary import BrdfDictionary
from .candidates import candidate_lights
from .cell_albedo import CellAlbedo, CellGrid, shared_albedo
from .coarse_search import Candidate, best_candidates
from .jackknife import PIXELS as JACKKNIFE_PIXELS
from .jackknife import standard_errors
from .lamp_photo import LampPhoto
from .local_search import cost_with_gain, minimised_light
from .materials import shared_materials
from .shading import LampPixels, predicted

Array = NDArray[np.float64]
Float32 = NDArray[np.float32]

MIN_PIXELS = 200  # lit ones, of a lamp
COARSE_PIXELS, FINE_PIXELS = 1600, 6000  # of a lamp
MAX_STARTS = 6  # lamps whose own material starts the shared one
SHARED_ROUNDS = 6
FINE_SCALES = (1.0, 0.5, 0.25, 0.12)  # of the first simplex, in typical changes of the parameters
OTHER_DIRECTION = np.cos(np.radians(25.0))  # farther away is another explanation, not the same
AMBIGUOUS_RATIO = 1.1  # of the costs of two explanations that the photos hardly tell apart
COARSE_SHARE, FINE_SHARE = 0.35, 0.6  # of the time, at the ends of these parts


@dataclass(frozen=True)
class UnknownLamp:
    """A lamp to find, or a known one that helps to know the material. light: of the kind that is
    searched, with a start value; photos: lit by it; known: keep its values."""

    light: Light
    photos: tuple[LampPhoto, ...]
    known: bool = False


@dataclass(frozen=True)
class FoundLamp:
    """light: found. standard_error: per axis, of the direction (radians) or of the position or
    offset (scan units); 90 % of directions lie within 2.84 of it
    (jackknife.RADIUS_90). cost: mean capped |log residual|.
    other: (3,) a different direction that explains the photos almost as well, None if there is
    none."""

    light: Light
    standard_error: float
    cost: float
    other: Array | None = None


@dataclass(frozen=True)
class FoundLamps:
    """lamps: in the order given, None for a known one. gains: strength of each lamp, also of known
    ones, relative to that of its light, in one unknown unit."""

    lamps: tuple[FoundLamp | None, ...]
    gains: tuple[float, ...]


@dataclass
class _State:
    """One lamp during the search."""

    lamp: UnknownLamp
    coarse: LampPixels
    fine: LampPixels
    candidates: list[Candidate]
    light: Light
    reach: float


def find_lamps(
    lamps: Sequence[UnknownLamp],
    materials: int,
    rays: RayScene,
    dictionary: BrdfDictionary,
    with_errors: bool = True,
) -> Generator[float, None, FoundLamps]:
    """Find all lamps of a capture together; a generator that yields the fraction done.

    materials: their number m; a pixel's index is in LampPhoto.material. with_errors False: without
    standard errors (NaN), in two thirds of the time. Raises PatinaError where a lamp's photos show
    too little of the mesh.
    """
    states = []
    for place, lamp in enumerate(lamps):
        state, lights = _opened(lamp)
        steps = best_candidates(lights, state.coarse, materials, rays, dictionary)
        state.candidates = yield from scaled(
            steps, COARSE_SHARE * place / len(lamps), COARSE_SHARE * (place + 1) / len(lamps)
        )
        state.light = state.candidates[0].light
        states.append(state)
    coefficients = _shared(states, [state.candidates[0].own for state in states])
    grid = CellGrid.around(np.concatenate([state.fine.points for state in states]))
    albedo = _albedo(states, coefficients, grid, _even_radiance(states, rays, dictionary))
    if albedo is not None:  # choose the candidates again
        for state in states:
            factor = albedo.at(state.coarse.points).astype(np.float32)[:, None]
            state.candidates = [replace(c, radiance=c.radiance * factor) for c in state.candidates]
        coefficients = _shared(states, [coefficients])
    for turn, scale in enumerate(FINE_SCALES):
        for place, state in enumerate(states):
            done = (turn + place / len(states)) / len(FINE_SCALES)
            yield COARSE_SHARE + (FINE_SHARE - COARSE_SHARE) * done
            if not state.lamp.known:
                state.light = minimised_light(
                    state.light,
                    state.lamp.light,
                    state.reach,
                    state.fine,
                    coefficients,
                    scale,
                    rays,
                    dictionary,
                )
        even = _even_radiance(states, rays, dictionary)
        albedo = _albedo(states, coefficients, grid, even)
        for state in states:
            state.fine = state.fine.with_albedo(albedo)
        radiance = [s.fine.times_albedo(one) for s, one in zip(states, even, strict=True)]
        coefficients = shared_materials([s.fine for s in states], radiance, coefficients)
    errors = [float("nan")] * len(states)
    if with_errors:
        steps_of_errors = standard_errors(
            [s.light for s in states], [s.lamp.light for s in states],
            [s.lamp.known for s in states],
            [s.fine.first(JACKKNIFE_PIXELS) for s in states],
            [s.reach for s in states], coefficients, rays, dictionary,
        )  # fmt: skip
        errors = yield from scaled(steps_of_errors, FINE_SHARE, 1.0)
    found: list[FoundLamp | None] = []
    for state, values, error in zip(states, radiance, errors, strict=True):
        cost = cost_with_gain(state.fine, values, coefficients)
        one = FoundLamp(state.light, error, cost, _other(state, coefficients))
        found.append(None if state.lamp.known else one)
    gains = tuple(
        state.fine.measured.gain(predicted(values, coefficients, state.fine.material))
        for state, values in zip(states, radiance, strict=True)
    )
    return FoundLamps(tuple(found), gains)


def _opened(lamp: UnknownLamp) -> tuple[_State, list[Light]]:
    """A lamp's pixels and its candidates. Raises PatinaError."""
    coarse = LampPixels.of(lamp.photos, COARSE_PIXELS)
    fine = LampPixels.of(lamp.photos, FINE_PIXELS)
    usable = int((fine.measured.radiance > 0).sum())
    if usable < MIN_PIXELS:
        raise PatinaError(
            f"Light {lamp.light.name!r}: its photos show {usable} lit pixels of the mesh; expected "
            f"at least {MIN_PIXELS}. Check that the mesh and the cameras fit these photos."
        )
    away = [np.linalg.norm(p.camera.pose.centre - p.point.mean(0)) for p in fine.parts]
    reach = float(np.median(away))
    lights = [lamp.light] if lamp.known else candidate_lights(lamp.light, coarse.points, reach)
    return _State(lamp, coarse, fine, [], lamp.light, reach), lights


def _even_radiance(
    states: Sequence[_State], rays: RayScene, dictionary: BrdfDictionary
) -> list[Float32]:
    """Radiance of the fine pixels of each lamp in its present light, for an even albedo."""
    return [
        state.fine.without_albedo().dictionary_radiance(state.light, rays, dictionary)
        for state in states
    ]


def _albedo(
    states: Sequence[_State], coefficients: Array, grid: CellGrid, even: Sequence[Float32]
) -> CellAlbedo | None:
    """The albedo of the surface's cells with the present materials. even: _even_radiance."""
    ratios = []
    for state, radiance in zip(states, even, strict=True):
        values = predicted(radiance, coefficients, state.fine.material)
        ratios.append(state.fine.measured.log_ratio(state.fine.measured.gain(values) * values))
    return shared_albedo(grid, [state.fine.points for state in states], ratios)


def _shared(states: Sequence[_State], starts: Sequence[Array]) -> Array:
    """(m, k) coefficients of the shared materials; sets each lamp's best candidate for them.

    starts: (m, k) each, tried in turn.
    """
    best: tuple[float, Array, list[Light]] | None = None
    for start in starts[:MAX_STARTS]:
        found = start / max(float(start.sum()), 1e-30)
        for _ in range(SHARED_ROUNDS):
            chosen, total = [], 0.0
            for state in states:
                costs = [
                    cost_with_gain(state.coarse, one.radiance, found) for one in state.candidates
                ]
                chosen.append(state.candidates[int(np.argmin(costs))])
                total += min(costs)
            if best is None or total < best[0]:
                best = total, found, [one.light for one in chosen]
            pixels, radiance = [s.coarse for s in states], [one.radiance for one in chosen]
            found = shared_materials(pixels, radiance, found)
    assert best is not None  # there is at least one lamp
    for state, light in zip(states, best[2], strict=True):
        state.light = light
    return best[1]


def _other(state: _State, coefficients: Array) -> Array | None:
    """(3,) a direction far from the found one that the photos exclude only weakly, or None."""
    if not isinstance(state.light, DistantLight):
        return None
    found = state.light.direction
    costs = [cost_with_gain(state.coarse, one.radiance, coefficients) for one in state.candidates]
    best = min(costs)
    for index in np.argsort(costs, kind="stable"):
        light = state.candidates[index].light
        assert isinstance(light, DistantLight)  # all candidates are of one kind
        if light.direction @ found < OTHER_DIRECTION:
            return light.direction if costs[index] < AMBIGUOUS_RATIO * best else None
    return None
