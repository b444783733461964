"""result.json, opened without believing it."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np

from ..appearance.principled import Principled
from ..basis import Basis, PrincipalBRDF
from ..errors import InputError
from ..scan.parsing.json_file import read_json
from ..scan.parsing.json_record import Record, root_record, shown
from .bases import basis_of_version
from .fitted import FittedMaterial, FittedResult, HeldOutError

NAME, SCENE = "result.json", "scene.blend"
FORMATS = (1, 2)
LARGEST = 64 << 20  # bytes: a hundred materials of a hundred components take one
MOST_MATERIALS = 1000
BEYOND = 1e3  # a coefficient of a training material is about 0.06
BRIGHTEST = 20.0  # ln(ρ·cosMap): a polished mirror's highlight has 10
NAME_LENGTH = 200
STEEPEST = 45.0  # degrees that normals may be off by
RANGES = {"ior": (1.0, 10.0), "coat_ior": (1.0, 10.0)}  # of the Principled's inputs beyond 0 … 1
FORBIDDEN = set('/\\:*?"<>|\0')


def read_result(path: Path, cache: Path | None = None) -> FittedResult:
    """The result in a folder, or in its result.json.

    cache: where bases of the user's own lie (default: the user's cache). Raises InputError, one
    line, for whatever is not a result that this version can read.
    """
    file = path / NAME if path.is_dir() else path
    record = root_record(read_json(_checked(file), LARGEST, "a result.json"), file)
    version = record.whole("format")
    if version not in FORMATS:
        raise record.error(
            f"is {version}; expected one of {', '.join(map(str, FORMATS))}: this result is of "
            "another version of Patina",
            "format",
        )
    basis = basis_of_version(record.record("basis").text("version"), file, cache)
    listed = record.records("materials")
    if not 0 < len(listed) <= MOST_MATERIALS:
        raise record.error(
            f"has {len(listed)} entries; expected 1 to {MOST_MATERIALS}", "materials"
        )
    materials = tuple(_material(entry, basis) for entry in listed)
    names = [material.name.casefold() for material in materials]
    for index, name in enumerate(names):
        if name in names[:index]:
            raise listed[index].error(f"{materials[index].name!r} is there twice", "name")
    scene = file.parent / SCENE
    program = record.record("program").text("version", "") if "program" in record else ""
    return FittedResult(
        file=file,
        program=program,
        capture=record.text("capture", ""),
        basis=basis,
        materials=materials,
        scene=scene if scene.is_file() else None,
    )


def _checked(file: Path) -> Path:
    """The file, where there is one."""
    try:
        if not file.exists():
            raise InputError(
                "is not there; expected a result: the folder that `fit` left, or its result.json",
                file=file,
            )
        if not file.is_file():
            raise InputError("is not a file; expected a result.json", file=file)
    except (OSError, ValueError) as error:  # ValueError: a path with a zero byte
        reason = getattr(error, "strerror", None) or error
        raise InputError(f"cannot be read ({reason})", file=file) from error
    return file


def _material(entry: Record, basis: Basis) -> FittedMaterial:
    fitted = entry.record("principled")
    return FittedMaterial(
        name=_name(entry),
        brdf=_brdf(entry, basis),
        principled=_principled(fitted),
        principled_error=_within(fitted, "cube_root_error", 0.0, 1e3),
        lambertian_error=_within(fitted, "lambertian_cube_root_error", 0.0, 1e3),
        estimator=entry.text("estimator", "paper"),
        scale_known=entry.flag("scale_known"),
        scale=_within(entry, "scale", 0.0, 1e12) if "scale" in entry else 1.0,
        held_out=_held_out(entry),
        normal_deviation=float(np.clip(entry.number("normal_deviation", 0.0), 0.0, STEEPEST)),
        warnings=_sentences(entry),
    )


def _name(entry: Record) -> str:
    """A name becomes a file's: what no file may be called is refused."""
    name = entry.text("name")
    if (
        not name.strip(" .")
        or len(name) > NAME_LENGTH
        or FORBIDDEN & set(name)
        or not name.isprintable()
    ):
        raise entry.error(f"is {shown(name)}; expected a name that a file can have", "name")
    return name


def _brdf(entry: Record, basis: Basis) -> PrincipalBRDF:
    value = entry.values.get("coefficients")
    rows = value if isinstance(value, list) else []
    width = len(rows[0]) if len(rows) == 3 and isinstance(rows[0], list) else 0
    if not 0 < width <= basis.count:
        raise entry.error(
            f"is {shown(value)}; expected three rows of 1 to {basis.count} numbers", "coefficients"
        )
    if any(not isinstance(row, list) or len(row) != width for row in rows):
        raise entry.error("has rows of different lengths", "coefficients")
    found = entry.numbers("coefficients", 3 * width).reshape(3, width)
    if np.abs(found).max() > BEYOND:
        raise entry.error(f"holds numbers beyond {BEYOND:g}", "coefficients")
    brdf = PrincipalBRDF(basis, found)
    if brdf.log_table.values.max() > BRIGHTEST:
        raise entry.error("make a reflectance beyond all measure", "coefficients")
    return brdf


def _principled(entry: Record) -> Principled:
    """The inputs that the file names, the others as the node has them."""
    told: dict[str, Any] = {}
    for name, default in vars(Principled()).items():
        if name not in entry:
            continue
        if np.ndim(default):
            told[name] = entry.numbers(name, np.size(default))
            if told[name].min() < 0 or told[name].max() > BEYOND:
                raise entry.error("is no colour; expected numbers from 0", name)
        else:
            told[name] = _within(entry, name, *RANGES.get(name, (0.0, 1.0)))
    return Principled(**told)


def _held_out(entry: Record) -> HeldOutError | None:
    if entry.values.get("held_out") is None:
        return None
    held = entry.record("held_out")
    return HeldOutError(
        _within(held, "error", 0.0, 1e12),
        _within(held, "typical", 0.0, 1e12) if "typical" in held else float("nan"),
    )


def _sentences(entry: Record) -> tuple[str, ...]:
    found = entry.values.get("warnings", [])
    if not isinstance(found, list) or len(found) > 1000:
        raise entry.error(f"is {shown(found)}; expected a list of sentences", "warnings")
    return tuple(" ".join(s.split())[:1000] for s in found if isinstance(s, str))


def _within(entry: Record, key: str, low: float, high: float) -> float:
    number = entry.number(key)
    if not low <= number <= high:
        raise entry.error(f"is {number:g}; expected {low:g} to {high:g}", key)
    return number
