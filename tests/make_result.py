"""Write a result folder as `fit` does, without a fit."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import numpy as np

from patina.core.basis import default_basis
from patina.core.export.subject import Subject
from patina.core.result import read_result

BRONZE, FABRIC, ACRYLIC = 0, 4, 10  # indices in the training set of the embedded basis
PRINCIPLED = {
    "base_color": [0.5, 0.25, 0.1],
    "metallic": 0.0,
    "roughness": 0.3,
    "ior": 1.5,
    "specular_ior_level": 0.4,
    "specular_tint": [1.0, 1.0, 1.0],
    "coat_weight": 0.2,
    "coat_roughness": 0.1,
    "coat_ior": 1.5,
    "cube_root_error": 0.06,
    "lambertian_cube_root_error": 0.5,
}


def coefficients(place: int) -> np.ndarray:
    """Return the coefficients (3, k) of a training material of the basis."""
    training = default_basis().training
    assert training is not None
    return training[3 * place : 3 * place + 3]


def material(name: str, place: int, /, **changes: Any) -> dict[str, Any]:
    """One entry of "materials"."""
    return {
        "name": name,
        "estimator": "measured",
        "coefficients": coefficients(place).tolist(),
        "scale_known": True,
        "scale": 1.0,
        "held_out": {"error": 0.3, "typical": 0.05, "per_photo": {"a.exr": 0.3}},
        "principled": dict(PRINCIPLED),
        "warnings": ["one", "two"],
        **changes,
    }


def description(*materials: dict[str, Any]) -> dict[str, Any]:
    """The content of a result.json."""
    return {
        "format": 2,
        "program": {"name": "patina", "version": "0.1.0"},
        "basis": {"version": default_basis().version, "components": 100, "columns": 300},
        "capture": "/somewhere/x.capture.toml",
        "materials": list(materials),
    }


def write_result(folder: Path, content: dict[str, Any]) -> Path:
    """Write result.json to a folder; return the folder."""
    folder.mkdir(parents=True, exist_ok=True)
    (folder / "result.json").write_text(json.dumps(content), "utf-8")
    return folder


def two_materials(folder: Path) -> Path:
    """A metal and a fabric."""
    metal = dict(PRINCIPLED, metallic=1.0, coat_weight=0.0, base_color=[0.7, 0.5, 0.3])
    return write_result(
        folder,
        description(
            material("bronze", BRONZE, principled=metal),
            material("old rug", FABRIC),
        ),
    )


def subjects(folder: Path) -> list[Subject]:
    """The materials of a result folder, to be exported."""
    return [Subject(material) for material in read_result(folder).materials]
