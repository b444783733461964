"""result.json: the results of a fit in a machine-readable file."""

from __future__ import annotations

import json
import tomllib
from collections.abc import Iterable, Sequence
from pathlib import Path
from typing import Any

import numpy as np

from ..appearance.lobe_stack import LobeStack
from ..files import write_text_atomic
from ..fit import PaperFit
from ..fit.measured_result import MeasuredResult
from ..fit.spread import Spread
from ..inputs import capture_data
from ..jobs import CaptureResult, MaterialResult, Stage
from ..jobs.applied_effects import AppliedEffect
from ..light import Light
from ..proposed_photo import ProposedPhoto
from ..varying import storage
from .figures import half_width, notable_gains

MANIFEST = Path(__file__).parents[2] / "blender_manifest.toml"
FORMAT = 2
PAPER_UNCERTAINTY = "std of ln(rho cosMap + 0.001) between trials; not calibrated"
MEASURED_UNCERTAINTY = (
    "posterior std of ln(rho cosMap + 0.001); interval_90: in nine of ten cases the true value "
    "differs by less than this fraction"
)


def program_version() -> str:
    """The version of the extension, from its manifest."""
    return str(tomllib.loads(MANIFEST.read_text("utf-8"))["version"])


def write(path: Path, result: CaptureResult, stages: Sequence[Stage], notes: Sequence[str]) -> None:
    """Write result.json of a fit atomically: a failed write leaves no partial file."""
    write_json(path, describe(result, stages, notes))


def write_json(path: Path, content: dict[str, Any]) -> None:
    """Write a JSON file atomically. Raises ValueError for NaN and infinite numbers."""
    write_text_atomic(path, json.dumps(content, indent=1, allow_nan=False) + "\n")


def describe(
    result: CaptureResult, stages: Sequence[Stage], notes: Sequence[str] = ()
) -> dict[str, Any]:
    """The content of result.json. Angles in degrees, ρ in 1/sr."""
    basis = result.basis
    return {
        "format": FORMAT,
        "program": {"name": "patina", "version": program_version()},
        "basis": {
            "version": basis.version,
            "components": basis.count,
            "columns": basis.columns,
            "provenance": basis.provenance,
        },
        "capture": str(result.capture.file),
        "notes": list(result.notes),
        "margins": vars(result.capture.fit.margins),
        "unexplained_by_lights": None
        if result.lights.unexplained is None
        else dict(zip(("before", "after"), result.lights.unexplained, strict=True)),
        "lights": [_light(result, light) for light in result.lights.by_name.values()],
        "effects": [_effect(effect) for effect in result.effects],
        "varying": _varying(result),
        "proposed_photo": _proposed_photo(result.proposed_photo),
        "materials": [_material(result, m) for m in result.materials],
        "warnings": list(notes),
        "stages": [
            {"name": s.name, "seconds": round(s.seconds, 3), "peak_mb": _rounded(s.peak_mb, 1)}
            for s in stages
        ],
    }


def _varying(result: CaptureResult) -> dict[str, Any] | None:
    """The file of the variation over the surface, and what varies over each material."""
    surface = result.varying
    if surface is None:
        return None
    return {
        "file": storage.NAME,
        "nodes": len(surface.grid),
        "spacing": surface.grid.spacing,
        "separated_from": surface.separated_from,
        "materials": [
            {
                "name": material.name,
                "varies": kind.kind,
                "held_out_cost": kind.cost,
                "held_out_typical": kind.typical,
            }
            for material, kind in zip(result.materials, surface.materials, strict=True)
        ],
    }


def _proposed_photo(photo: ProposedPhoto | None) -> dict[str, Any] | None:
    """The photo that would say most about the materials."""
    if photo is None:
        return None
    return {
        "camera": photo.camera,
        "towards_light": None if photo.towards is None else photo.towards.tolist(),
        "angle": photo.angle,
        "side": photo.side,
        "uncertainty": photo.before,
        "expected_uncertainty": photo.after,
        "sentence": photo.sentence,
    }


def _light(result: CaptureResult, light: Light) -> dict[str, Any]:
    """Kind, geometry and strength of a light; the refined parameters with standard errors."""
    parameters_by_name = {
        key: None if value is None else np.asarray(value, float).tolist()
        for key, value in vars(light).items()
        if key != "name"
    }
    moved = result.lights.moved.get(light.name, {})
    return {
        "name": light.name,
        "kind": type(light).__name__.removesuffix("Light").lower(),
        **parameters_by_name,
        "refined": {
            key: {"value": value, "standard_error": error if np.isfinite(error) else None}
            for key, (value, error) in moved.items()
        },
    }


def _effect(effect: AppliedEffect) -> dict[str, Any]:
    """A cause found by the diagnosis and included in the fit of the materials."""
    return {
        "cause": effect.cause,
        "sentence": effect.sentence,
        "parameters": parameters(effect.names, effect.units, effect.numbers, effect.errors),
    }


def parameters(
    names: Sequence[str], units: Sequence[str], values: Iterable[float], errors: Iterable[float]
) -> dict[str, Any]:
    """The parameters of an effect by name, each with its standard error and unit."""
    rows = zip(names, units, values, errors, strict=True)
    return {
        name: {"value": float(value), "standard_error": float(error), "unit": unit}
        for name, unit, value, error in rows
    }


def _quality(material: MaterialResult) -> dict[str, str]:
    quality = material.quality
    return {"rating": quality.rating.value, "sentence": quality.sentence}


def _material(result: CaptureResult, material: MaterialResult) -> dict[str, Any]:
    fit, held, principled = material.fit, material.held_out, material.principled
    names = [result.capture.photo_name(place) for place in range(len(result.capture.photos))]
    if isinstance(fit, MeasuredResult):
        own, measure = _measured(fit, names), MEASURED_UNCERTAINTY
    else:
        own, measure = _paper(result, fit, names), PAPER_UNCERTAINTY
    return {
        "name": material.name,
        "estimator": "measured" if isinstance(fit, MeasuredResult) else "paper",
        "coefficients": fit.brdf.coefficients.tolist(),
        "scale_known": material.irradiance_known,
        "scale": material.scale,
        "samples": {
            "taken": material.samples,
            "used": material.used,
            **({} if isinstance(fit, MeasuredResult) else {"on_calm_surface": fit.reliable}),
            "per_photo": dict(zip(names, material.per_photo, strict=True)),
        },
        **own,
        "held_out": None
        if held is None
        else {
            "measure": "relative RMS error of lit pixels, each photo predicted from the others, "
            "at the scan's own normals",
            "error": held.error,
            "typical": held.typical,
            "per_photo": {names[i]: e for i, e in held.per_photo.items()},
        },
        "quality": _quality(material),
        "uncertainty": {
            "measure": measure,
            "median": material.spread.median,
            "percentile_90": material.spread.percentile_90,
            "at_highlight": material.spread.at_highlight,
            **(_interval(material.spread) if isinstance(fit, MeasuredResult) else {}),
        },
        "principled": {
            **{k: _plain(v) for k, v in vars(principled.principled).items()},
            "cube_root_error": principled.error,
            "lambertian_cube_root_error": principled.diffuse_error,
        },
        "lobe_stack": _lobe_stack(material.lobes.plain, material.lobes.plain_error),
        "turning_lobe_stack": _lobe_stack(material.lobes.stack, material.lobes.error),
        "warnings": list(material.warnings),
    }


def _lobe_stack(stack: LobeStack, error: float) -> dict[str, Any]:
    return {
        "diffuse": stack.diffuse.tolist(),
        **_grazing_colors("diffuse", stack.diffuse_mid, stack.diffuse_edge),
        "diffuse_roughness": stack.diffuse_roughness,
        "lobes": [
            {
                "f0": lobe.f0.tolist(),
                **_grazing_colors("f0", lobe.f0_mid, lobe.f0_edge),
                "f90": lobe.f90.tolist(),
                "exponent": lobe.exponent,
                "roughness": lobe.roughness,
            }
            for lobe in stack.lobes
        ],
        "cube_root_error": error,
    }


def _grazing_colors(name: str, mid: np.ndarray | None, edge: np.ndarray | None) -> dict[str, Any]:
    """The colours of a lobe midway and at grazing view, where the lobe has them."""
    colors = {f"{name}_mid": mid, f"{name}_edge": edge}
    return {key: color.tolist() for key, color in colors.items() if color is not None}


def _measured(fit: MeasuredResult, names: Sequence[str]) -> dict[str, Any]:
    return {
        "normal_deviation": fit.normal_deviation,
        "gains": {names[photo]: gain for photo, gain in sorted(notable_gains(fit).items())},
        "unseen_directions": fit.extrapolation,
    }


def _interval(spread: Spread) -> dict[str, Any]:
    return {"interval_90": {key: half_width(value) for key, value in vars(spread).items()}}


def _paper(result: CaptureResult, fit: PaperFit, names: Sequence[str]) -> dict[str, Any]:
    selected = fit.chosen
    width = {
        photo: capture_data.camera_of(result.capture, result.scan, photo).width
        for photo in np.unique(selected.photo).tolist()
    }
    return {
        "chosen": [
            {
                "photo": names[int(selected.photo[i])],
                "pixel": [
                    int(selected.pixel[i] % width[int(selected.photo[i])]),
                    int(selected.pixel[i] // width[int(selected.photo[i])]),
                ],
                "theta_h": _degrees(selected.theta_h[i]),
                "theta_d": _degrees(selected.theta_d[i]),
                "phi_d": _degrees(selected.phi_d[i]),
                "rho": [float(x) for x in selected.rho[i]],
            }
            for i in range(len(selected))
        ],
        "condition_number": fit.condition,
        "cosine_similarity": fit.similarity.tolist(),
    }


def _plain(value: Any) -> Any:
    return value.tolist() if isinstance(value, np.ndarray) else value


def _degrees(angle: float) -> float:
    return round(float(np.degrees(angle)), 4)


def _rounded(value: float | None, digits: int) -> float | None:
    return None if value is None else round(value, digits)
