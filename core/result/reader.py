"""Read result.json; every value is checked, because the file may come from anywhere."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np

from ..appearance.principled import Principled
from ..basis import Basis, PrincipalBRDF
from ..errors import InputError
from ..output_folder import complete_publication
from ..scan.parsing.json_file import read_json
from ..scan.parsing.json_record import Record, root_record, shown
from .bases import basis_of_version
from .fitted import FittedMaterial, FittedResult, HeldOutError

NAME, SCENE = "result.json", "scene.blend"
FORMATS = (1, 2)
MAX_BYTES = 64 << 20  # a hundred materials of a hundred components take 1 MB
MAX_MATERIALS = 1000
MAX_COEFFICIENT = 1e3  # a coefficient of a training material is about 0.06
MAX_LOG_RHO = 20.0  # ln(ρ·cosMap): a polished mirror's highlight has 10
MAX_NAME_LENGTH = 200  # characters
MAX_EFFECTS, MAX_PARAMETERS = 100, 10_000  # causes of a diagnosis; parameters of each
MAX_PARAMETER = 1e9  # of an effect: a displacement in scan units may be large
MAX_NORMAL_DEVIATION = 45.0  # degrees
RANGES = {"ior": (1.0, 10.0), "coat_ior": (1.0, 10.0)}  # Principled inputs with other than 0 … 1
FORBIDDEN = set('/\\:*?"<>|\0')


def read_result(path: Path, cache: Path | None = None) -> FittedResult:
    """Read a result from its folder or from its result.json.

    cache: folder of the user's own bases (default: the user's cache). Raises InputError, one line,
    for anything that is not a result that this version can read.
    """
    file = path / NAME if path.is_dir() else path
    complete_publication(file.parent)
    record = root_record(read_json(_checked(file), MAX_BYTES, "a result.json"), file)
    version = record.whole("format")
    if version not in FORMATS:
        raise record.error(
            f"is {version}; expected one of {', '.join(map(str, FORMATS))}; another version of "
            "Patina wrote this result: open it with that version, or fit again",
            "format",
        )
    basis = basis_of_version(record.record("basis").text("version"), file, cache)
    listed = record.records("materials")
    if not 0 < len(listed) <= MAX_MATERIALS:
        raise record.error(f"has {len(listed)} entries; expected 1 to {MAX_MATERIALS}", "materials")
    materials = tuple(_material(entry, basis) for entry in listed)
    names = [material.name.casefold() for material in materials]
    for index, name in enumerate(names):
        if name in names[:index]:
            raise listed[index].error(
                f"{materials[index].name!r} appears twice; expected unique names", "name"
            )
    scene = file.parent / SCENE
    program = record.record("program").text("version", "") if "program" in record else ""
    return FittedResult(
        file=file,
        program=program,
        capture=record.text("capture", ""),
        basis=basis,
        materials=materials,
        scene=scene if scene.is_file() else None,
        effects=_effects(record),
        varying=_varying(record, file.parent),
        varying_names=_varying_names(record),
        separated_from=_separated_from(record),
    )


def _checked(file: Path) -> Path:
    """``file`` itself. Raises InputError where it does not exist or is not a file."""
    try:
        if not file.exists():
            raise InputError(
                "does not exist; expected a result: the folder that `fit` wrote, or its "
                "result.json",
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
        normal_deviation=float(
            np.clip(entry.number("normal_deviation", 0.0), 0.0, MAX_NORMAL_DEVIATION)
        ),
        warnings=_sentences(entry),
    )


def _name(entry: Record) -> str:
    """The material's name. It becomes a file name, so names that no file can have are rejected."""
    name = entry.text("name")
    if (
        not name.strip(" .")
        or len(name) > MAX_NAME_LENGTH
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
        raise entry.error("has rows of different lengths; expected equal lengths", "coefficients")
    found = entry.numbers("coefficients", 3 * width).reshape(3, width)
    if np.abs(found).max() > MAX_COEFFICIENT:
        raise entry.error(
            f"holds numbers beyond ±{MAX_COEFFICIENT:g}; the file is damaged", "coefficients"
        )
    brdf = PrincipalBRDF(basis, found)
    if brdf.log_table.values.max() > MAX_LOG_RHO:
        raise entry.error(
            "give a reflectance that no material has; the file is damaged", "coefficients"
        )
    return brdf


def _principled(entry: Record) -> Principled:
    """The Principled BSDF: inputs from the file, defaults of the node for missing ones."""
    inputs: dict[str, Any] = {}
    for name, default in vars(Principled()).items():
        if name not in entry:
            continue
        if np.ndim(default):
            inputs[name] = entry.numbers(name, np.size(default))
            if inputs[name].min() < 0 or inputs[name].max() > MAX_COEFFICIENT:
                raise entry.error("is not a colour; expected numbers from 0", name)
        else:
            inputs[name] = _within(entry, name, *RANGES.get(name, (0.0, 1.0)))
    return Principled(**inputs)


def _held_out(entry: Record) -> HeldOutError | None:
    if entry.values.get("held_out") is None:
        return None
    held = entry.record("held_out")
    return HeldOutError(
        _within(held, "error", 0.0, 1e12),
        _within(held, "typical", 0.0, 1e12) if "typical" in held else float("nan"),
    )


def _effects(record: Record) -> dict[str, dict[str, float]]:
    """Cause → parameter → value, of the causes that the materials take into account."""
    if "effects" not in record:
        return {}
    found: dict[str, dict[str, float]] = {}
    for entry in record.records("effects")[:MAX_EFFECTS]:
        parameters = entry.record("parameters")
        found[entry.text("cause")] = {
            name: _within(parameters.record(name), "value", -MAX_PARAMETER, MAX_PARAMETER)
            for name in list(parameters.values)[:MAX_PARAMETERS]
        }
    return found


def _varying(record: Record, folder: Path) -> Path | None:
    """The file of the variation over the surface. It must be in the folder of the result."""
    if record.values.get("varying") is None:
        return None
    entry = record.record("varying")
    if entry.values.get("file") is None:  # exported without it
        return None
    name = entry.text("file")
    found = folder / name
    if name in ("", ".", "..") or FORBIDDEN & set(name) or not found.is_file():
        raise entry.error(
            f"is {shown(name)}; expected a file in the folder of the result; copy the whole folder",
            "file",
        )
    return found


def _varying_names(record: Record) -> tuple[str, ...]:
    """The materials that vary over the surface."""
    if record.values.get("varying") is None:
        return ()
    listed = record.record("varying").values.get("materials", [])
    if not isinstance(listed, list):
        return ()
    entries = [one for one in listed[:MAX_MATERIALS] if isinstance(one, dict)]
    return tuple(str(one.get("name")) for one in entries if one.get("varies") != "even")


def _separated_from(record: Record) -> str | None:
    """The material of the capture that the result's materials are parts of."""
    if record.values.get("varying") is None:
        return None
    found = record.record("varying").values.get("separated_from")
    return found if isinstance(found, str) else None


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
