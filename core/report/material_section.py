"""The section of the report about one material: lit spheres, table and charts."""

from __future__ import annotations

from collections.abc import Sequence
from html import escape
from pathlib import Path
from urllib.parse import quote

import numpy as np

from ..fit.measured_result import MeasuredResult
from ..jobs import MaterialResult
from ..photo import write_png
from ..views.charts import View, best_sampled_theta_d, chart
from ..views.polar import NEAR_PLANE, polar
from ..views.raster import raster
from ..views.sphere import Reflector, write_sphere
from ..views.subject import Subject
from ..views.svg import svg
from .figures import figures


def material_section(folder: Path, material: MaterialResult, photos: Sequence[str]) -> str:
    """HTML of a material's pictures, table and charts; writes the pictures into ``folder``."""
    fit, brdf = material.fit, material.fit.brdf
    interval = fit.interval if isinstance(fit, MeasuredResult) else None
    spheres = _spheres(folder, material)
    subject = Subject(material.name, brdf.evaluate, interval, material.points)
    charts = "".join(
        f"<figure>{svg(polar([subject], incidence))}</figure>" for incidence in (15, 45, 70)
    )
    warnings = "".join(f"<p class='warn'>{escape(w)}</p>" for w in material.warnings)
    rows = "".join(
        f"<tr><th>{escape(key)}</th><td>{escape(value)}</td></tr>"
        for key, value in figures(material, photos)
    )
    shaded = "" if interval is None else "; shaded: the 90 % interval"
    return (
        f"<h2>{escape(material.name)}</h2>{warnings}<div class='triple'>{spheres}</div>"
        f"<p class='sub'>Lit spheres; key light at the upper left, irradiance π. Error: relative "
        f"error of the cube root of ρ cos θi over all directions.</p><table>{rows}</table>"
        f"<div class='charts'>{charts}</div><p class='sub'>Reflectance in the plane of incidence, "
        f"light from the left; one curve each for red, green and blue{shaded}; dots: "
        f"samples within {np.degrees(NEAR_PLANE):.0f}° of this plane.</p>{_slices(folder, subject)}"
    )


def _slices(folder: Path, subject: Subject) -> str:
    """HTML of the highlight curve and of the θh × θd slices of the BRDF and of its interval."""
    view = View(theta_d=best_sampled_theta_d(subject) or View.theta_d)
    cells = [f"<figure>{svg(chart('highlight', subject, None, view))}</figure>"]
    kinds = ("slice",) if subject.interval is None else ("slice", "interval")
    for kind in kinds:
        name = f"{kind}_{subject.label}.png"
        write_png(folder / name, raster(chart(kind, subject, None, view)))
        cells.append(f"<figure><img src='{escape(quote(name))}' alt='{kind}'></figure>")
    return (
        f"<div class='charts'>{''.join(cells)}</div><p class='sub'>Left: the highlight at the θd "
        "with most samples. Middle: the BRDF over the angles from the half vector to the normal "
        "(θh) and to the light (θd), with a part of the samples. Right, for the measured method: "
        "the 90 % interval; dark directions are uncertain, because no photo shows them.</p>"
    )


def _spheres(folder: Path, material: MaterialResult) -> str:
    """HTML of lit spheres of the measured BRDF, its lobe stack and its Principled BSDF."""
    lobes, principled = material.lobes, material.principled
    shown: list[tuple[str, str, Reflector]] = [
        ("sphere", "Measured BRDF (Cycles with OSL)", material.fit.brdf.evaluate),
        ("lobes", f"Lobe stack (EEVEE), error {100 * lobes.error:.1f} %", lobes.stack),
        (
            "principled",
            f"Principled BSDF (exports), error {100 * principled.error:.1f} %",
            principled.principled,
        ),
    ]
    cells = []
    for kind, label, reflector in shown:
        name = f"{kind}_{material.name}.png"  # the kind first: material names may end in anything
        write_sphere(folder / name, reflector)
        cells.append(
            f"<figure><img src='{escape(quote(name))}' alt='lit sphere, {label}'>"
            f"<figcaption>{label}</figcaption></figure>"
        )
    return "".join(cells)
