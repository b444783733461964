"""The 350 captures of the full table of the hunt."""

from __future__ import annotations

from collections.abc import Iterator, Sequence

STRENGTHS = (0.01, 0.03, 0.1)  # relative RMS change of the photos
SINGLE_STRENGTH = 0.03  # of each effect of a pair, and of the effects of BEYOND
SEEDS = 5  # of captures with an effect
NONES = 40  # seeds of captures without an effect

PAIRS = {
    1: (
        "near_light+vignetting", "ambient_light+veiling_glare", "camera_response+clipping",
        "area_light+light_intensity", "subsurface+camera_response", "normal_error+vignetting",
    ),
    2: (
        "light_intensity+vignetting", "camera_pose+light_intensity",
        "interreflection+veiling_glare", "outside_basis+clipping",
        "environment_reflection+veiling_glare", "anisotropy+camera_response",
    ),
    3: (
        "light_direction+camera_response", "light_intensity+camera_response",
        "near_light+light_intensity", "veiling_glare+clipping", "vignetting+veiling_glare",
        "second_material+vignetting",
    ),
    4: (
        "cast_shadow+clipping", "light_intensity+clipping", "veiling_glare+light_intensity",
        "camera_pose+veiling_glare", "area_light+clipping", "vignetting+camera_response",
    ),
    5: (
        "light_direction+vignetting", "veiling_glare+camera_response", "normal_error+clipping",
        "ambient_light+light_intensity", "interreflection+vignetting",
        "second_material+camera_response",
    ),
}  # fmt: skip
"""Seed → pairs of effects, in the order in which they act on the light. Seven were chosen by hand.
The others were drawn such that every cause is in one pair, and every effect that can be applied to
photos is in six or more."""

BEYOND = {
    1: ("smudge", "moire", "white_balance"),
    2: ("smudge", "moire"),
    3: ("white_balance", "moire"),
    4: ("smudge", "white_balance"),
    5: ("moire",),
}
"""Seed → effects that are no cause of the diagnosis."""


def captures(vocabulary: Sequence[str], seeds: Sequence[int]) -> Iterator[tuple[str, float, int]]:
    """Yield (cause, requested RMS change, seed), by seed so that shared renders are reused."""
    for seed in seeds:
        yield "none", 0.0, seed
        if seed > SEEDS:
            continue
        for cause in vocabulary:
            for strength in STRENGTHS:
                yield cause, strength, seed
        for cause in (*BEYOND[seed], *PAIRS[seed]):
            yield cause, SINGLE_STRENGTH, seed
