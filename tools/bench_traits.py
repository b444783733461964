"""Write the table of docs/guide/traits.md: the effect of each slider of a measured material."""

from __future__ import annotations

import re
import time
from pathlib import Path
from typing import TYPE_CHECKING

from .common import ROOT

if TYPE_CHECKING:
    from patina.core.basis import Basis

DOCUMENT = ROOT / "docs" / "guide" / "traits.md"


def run(data: Path) -> None:
    """Write the table to the document, and print the time of a change. data: not used."""
    import numpy as np

    from patina.core.appearance.osl_atlas import TRAITS
    from patina.core.appearance.traits import ComponentLookup, ShiftableAlbedo, ShiftableBRDF
    from patina.core.basis import PrincipalBRDF, default_basis
    from patina.core.views import display
    from patina.core.views.sphere import LitSphere

    basis = default_basis()
    text = DOCUMENT.read_text(encoding="utf-8")
    made = re.sub(
        r"(<!-- begin traits -->\n).*?(\n<!-- end traits -->)",
        lambda found: found.group(1) + table(basis) + found.group(2),
        text,
        flags=re.S,
    )
    DOCUMENT.write_text(made, encoding="utf-8")
    print(table(basis))
    brdf = PrincipalBRDF(basis, np.zeros((3, basis.count)))
    sphere = LitSphere.of(128)
    parts = [ShiftableBRDF.of(brdf, ComponentLookup.of(basis, p.angles)) for p in sphere.parts]
    albedo = ShiftableAlbedo.of(brdf)
    shifts = np.full((3, TRAITS), 0.5)
    for what, work in (
        ("sphere", lambda: display.srgb(sphere.picture([p.at(shifts) for p in parts])[0])),
        ("albedo", lambda: albedo.at(shifts)),
    ):
        taken = []
        for _ in range(9):
            start = time.perf_counter()
            work()
            taken.append(time.perf_counter() - start)
        print(f"{what}: {1000 * float(np.median(taken)):.1f} ms per change")


def table(basis: Basis) -> str:
    """Return a table of the factors of each quantity in core/appearance/trait_words.py, for one
    standard deviation of each component."""
    import numpy as np

    from patina.core.appearance.trait_words import effects, words

    found = effects(basis)
    lines = [
        "| component | variance | up by one standard deviation | body | peak | width "
        "| at grazing angles |",
        "|---|---|---|---|---|---|---|",
    ]
    for i, (effect, word) in enumerate(zip(found, words(found), strict=True)):
        each = (effect.body, effect.peak, effect.width, effect.grazing)
        factors = " | ".join(f"× {np.exp(e):.2f}" for e in each)
        lines.append(f"| {i + 1} | {100 * basis.explained[i]:.1f} % | {word} | {factors} |")
    return "\n".join(lines)
