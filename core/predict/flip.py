"""FLIP, the difference that an observer sees between two pictures (Andersson et al. 2020)."""

from __future__ import annotations

import importlib
from types import ModuleType

import numpy as np
from numpy.typing import NDArray

MISSING = (
    "FLIP was not computed. It needs the optional package flip-evaluator (the extra `flip` of the "
    "Python package)."
)


def flip_available() -> bool:
    """Whether the optional package flip-evaluator is installed."""
    return _evaluator() is not None


def flip_error(
    predicted: NDArray[np.uint8], measured: NDArray[np.uint8], compared: NDArray[np.bool_]
) -> float | None:
    """Mean FLIP error, 0..1, of the pixels ``compared`` (h, w) of two sRGB pictures (h, w, 3), seen
    at 67 pixels per degree. Other pixels are made equal before. None without the optional package
    flip-evaluator, NaN without any such pixel."""
    flip = _evaluator()
    if flip is None:
        return None
    if not compared.any():
        return float("nan")
    reference = measured.astype(np.float32) / 255
    test = np.where(compared[..., None], predicted.astype(np.float32) / 255, reference)
    errors, _, _ = flip.evaluate(
        reference, test, "LDR", inputsRGB=True, applyMagma=False, computeMeanError=False
    )
    return float(np.mean(errors[..., 0][compared]))


def _evaluator() -> ModuleType | None:
    try:
        return importlib.import_module("flip_evaluator")
    except ImportError:
        return None
