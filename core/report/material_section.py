"""What a report shows of one material."""

from __future__ import annotations

from collections.abc import Sequence
from html import escape
from pathlib import Path
from urllib.parse import quote

import numpy as np

from ..fit.measured_result import MeasuredResult
from ..jobs import MaterialResult
from ..photo import write_png
from ..views.charts import View, chart, most_measured
from ..views.polar import NEAR_PLANE, polar
from ..views.raster import raster
from ..views.sphere import Reflector, write_sphere
from ..views.subject import Subject
from ..views.svg import svg
from .figures import figures


def material_section(folder: Path, material: MaterialResult, photos: Sequence[str]) -> str:
    """HTML of a material's pictures, figures and charts; the pictures go into ``folder``."""
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
        f"<p class='sub'>Lit spheres, key light π at the upper left. Error: of the cube root of "
        f"ρ cos θ over all directions.</p><table>{rows}</table>"
        f"<div class='charts'>{charts}</div><p class='sub'>Reflectance in the plane of incidence, "
        f"light from the left; a curve for each of red, green and blue{shaded}; dots: "
        f"samples within {np.degrees(NEAR_PLANE):.0f}° of it.</p>{_slices(folder, subject)}"
    )


def _slices(folder: Path, subject: Subject) -> str:
    """The highlight, and the BRDF and its certainty over half and difference angle."""
    view = View(theta_d=most_measured(subject) or View.theta_d)
    cells = [f"<figure>{svg(chart('highlight', subject, None, view))}</figure>"]
    kinds = ("slice",) if subject.interval is None else ("slice", "interval")
    for kind in kinds:
        name = f"{kind}_{subject.label}.png"
        write_png(folder / name, raster(chart(kind, subject, None, view)))
        cells.append(f"<figure><img src='{escape(quote(name))}' alt='{kind}'></figure>")
    return (
        f"<div class='charts'>{''.join(cells)}</div><p class='sub'>The highlight where most "
        "samples are; the BRDF over the half vector's angles to normal (θh) and light (θd), "
        "with some of the samples; and how far off it may be: dark is what no photo looked at.</p>"
    )


def _spheres(folder: Path, material: MaterialResult) -> str:
    """Figures of the measured BRDF, its lobe stack and its Principled, side by side."""
    lobes, principled = material.lobes, material.principled
    shown: list[tuple[str, str, Reflector]] = [
        ("", "measured: Cycles with OSL", material.fit.brdf.evaluate),
        ("_lobes", f"lobe stack: EEVEE, error {100 * lobes.error:.1f} %", lobes.stack),
        (
            "_principled",
            f"Principled: exports, error {100 * principled.error:.1f} %",
            principled.principled,
        ),
    ]
    cells = []
    for suffix, label, reflector in shown:
        name = f"sphere_{material.name}{suffix}.png"
        write_sphere(folder / name, reflector)
        cells.append(
            f"<figure><img src='{escape(quote(name))}' alt='lit sphere, {label}'>"
            f"<figcaption>{label}</figcaption></figure>"
        )
    return "".join(cells)
