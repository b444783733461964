"""The OSL source with a given number of coefficients as inputs, and the list of all inputs."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

import numpy as np

from ..basis import Basis
from ..basis.mapping import EPSILON
from . import closure_split, osl_atlas, sampling_table
from .hemisphere import KNEE as CELL_KNEE

TEMPLATE = Path(__file__).parents[2] / "assets" / "osl" / "patina_brdf.osl"
LAMPS = 8  # largest number of lamps
# inputs that are paths of pictures
COMPONENTS, REMAINDER, SAMPLING = "components", "remainder", "sampling"
ALPHAS = "alphas"  # of the lobes that Cycles samples
BODY = "body"  # level of the diffuse body, 1/sr
# factors over the surface: of the diffuse body, of the specular part, of α
BODY_SCALE, SPECULAR_SCALE, ROUGHNESS_SCALE = "body_scale", "specular_scale", "roughness_scale"
# the table of the world, and the rows of the rotation from world space to its picture
WORLD = ("world", "world_x", "world_y", "world_z")


@dataclass(frozen=True)
class Input:
    """One input of the shader. kind: string, float, int, vector or color; hidden: set by Patina,
    not by the user."""

    name: str
    label: str
    kind: str
    default: object
    hidden: bool = False


def coefficient_name(component: int) -> str:
    """Name of the input of component 0, 1, …"""
    return f"coefficient_{component + 1}"


def coefficient_inputs(count: int) -> list[Input]:
    """The coefficient of every component, R, G and B as the X, Y and Z of a vector."""
    return [
        Input(coefficient_name(i), f"Coefficient {i + 1}", "vector", (0.0, 0.0, 0.0))
        for i in range(count)
    ]


def lamp_inputs() -> list[Input]:
    """The table of lamps, six inputs per lamp (see lamp_light in the shader)."""
    parts = (("kind", "int", 0), ("at", "vector", (0.0,) * 3), ("power", "color", (0.0,) * 3),
             ("axis", "vector", (0.0,) * 3), ("side", "vector", (0.0,) * 3),
             ("form", "vector", (0.0,) * 3))  # fmt: skip
    return [
        Input(f"lamp{i + 1}_{part}", f"Lamp {i + 1} {part}", kind, default, hidden=True)
        for i in range(LAMPS)
        for part, kind, default in parts
    ]


def inputs(count: int) -> list[Input]:
    """All inputs in the order of the shader's parameters."""
    return [
        Input(COMPONENTS, "Components", "string", ""),
        Input(REMAINDER, "Remainder", "string", ""),
        Input(SAMPLING, "Sampling", "string", ""),
        Input("shading_normal", "Normal", "vector", (0.0, 0.0, 0.0)),
        Input("scale", "Reflectance Scale", "float", 1.0),
        Input(BODY, "Body", "vector", (0.0, 0.0, 0.0), hidden=True),
        Input(BODY_SCALE, "Body Scale", "color", (1.0, 1.0, 1.0)),
        Input(SPECULAR_SCALE, "Specular Scale", "color", (1.0, 1.0, 1.0)),
        Input(ROUGHNESS_SCALE, "Roughness Scale", "float", 1.0),
        Input(ALPHAS, "Lobes", "vector", (0.02, 0.1, 0.5), hidden=True),
        *coefficient_inputs(count),
        Input(WORLD[0], "World", "string", "", hidden=True),
        *(
            Input(name, f"World {axis}", "vector", tuple(row), hidden=True)
            for name, axis, row in zip(WORLD[1:], "XYZ", np.eye(3).tolist(), strict=True)
        ),
        *lamp_inputs(),
    ]


def source(basis: Basis, count: int) -> str:
    """OSL text with the coefficients of the first ``count`` components as inputs."""
    words = {
        "COMPONENTS": str(count),
        "LAMPS": str(LAMPS),
        "NODES_H": str(basis.grid.n_h),
        "NODES_D": str(basis.grid.n_d),
        "NODES_P": str(basis.grid.n_p),
        "KNEE": repr(float(basis.grid.knee)),
        "BORDER": str(osl_atlas.BORDER),
        "GROUPS": str(osl_atlas.groups(count)),
        "HEIGHT_GROUPS": str(osl_atlas.groups(osl_atlas.traits(basis.count))),
        "EPSILON": repr(EPSILON),
        "VIEWS": str(closure_split.VIEWS),
        "GRAZING": repr(float(closure_split.GRAZING)),
        "KNOTS": str(closure_split.KNOTS),
        "LOBES": str(closure_split.LOBES),
        "CELLS_H": str(sampling_table.CELLS[0]),
        "CELLS_P": str(sampling_table.CELLS[1]),
        "CELL_KNEE": repr(float(CELL_KNEE)),
        "WIDTH": str(sampling_table.WIDTH),
        "COEFFICIENT_INPUTS": _parameters(coefficient_inputs(count)),
        "LAMP_INPUTS": _parameters(lamp_inputs()),
        "COEFFICIENT_NAMES": ", ".join(i.name for i in coefficient_inputs(count)),
    }
    plural = {"kind": "KINDS", "at": "ATS", "power": "POWERS", "axis": "AXES", "side": "SIDES",
              "form": "FORMS"}  # fmt: skip
    for part, word in plural.items():
        words[f"LAMP_{word}"] = ", ".join(f"lamp{i + 1}_{part}" for i in range(LAMPS))
    text = TEMPLATE.read_text(encoding="utf-8")
    for word, value in words.items():
        text = text.replace(f"@{word}@", value)
    return text


def _parameters(listed: list[Input]) -> str:
    """OSL declarations of some inputs."""
    lines = []
    for i in listed:
        zero = "0" if i.kind == "int" else f"{i.kind}(0)"
        lines.append(f'  {i.kind} {i.name} = {zero} [[string label = "{i.label}"]],')
    return "\n".join(lines)
