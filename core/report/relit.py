"""Renderings under other light, as a separate page and as a section of the report."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from html import escape
from pathlib import Path
from urllib.parse import quote

from ..files import write_text_atomic

STYLE = Path(__file__).parents[2] / "assets" / "report" / "style.css"
MAX_TURNTABLE_PICTURES = 8  # shown of each turntable
END = "</html>"


@dataclass(frozen=True)
class Picture:
    """One rendering. file: relative to the folder of the page; world: the name of the lighting;
    subject: the name of a material (a sphere), or "object"; turn: the step of the turntable, None
    for a sphere."""

    file: Path
    world: str
    subject: str
    turn: int | None = None


def write_page(folder: Path, pictures: Sequence[Picture]) -> Path:
    """Write index.html into the folder of the pictures; returns its path."""
    page = folder / "index.html"
    page.write_text(
        "<!doctype html><html lang='en'><meta charset='utf-8'><title>Patina: other light</title>"
        f"<style>{STYLE.read_text('utf-8')}</style><h1>Under other light</h1>"
        f"{section(pictures)}{END}",
        "utf-8",
    )
    return page


def add_to_report(page: Path, pictures: Sequence[Picture], folder: str) -> None:
    """Append the pictures to a report. folder: the folder of the pictures, relative to the page.
    A page that does not end with ``</html>`` stays unchanged."""
    text = page.read_text("utf-8")
    if not text.endswith(END) or not pictures:
        return
    part = f"<h2>Under other light</h2>{section(pictures, folder)}"
    write_text_atomic(page, text[: -len(END)] + part + END)


def section(pictures: Sequence[Picture], folder: str = "") -> str:
    """HTML: for each world, a row of spheres and a row of turntable pictures."""
    rows = []
    for world in dict.fromkeys(p.world for p in pictures):
        spheres = [p for p in pictures if p.world == world and p.turn is None]
        turn = [p for p in pictures if p.world == world and p.turn is not None]
        step = max(1, -(-len(turn) // MAX_TURNTABLE_PICTURES))
        rows.append(f"<p class='sub'>{escape(world)}</p>")
        for shown in (spheres, turn[::step]):
            if shown:
                rows.append(
                    f"<div class='relit'>{''.join(_figure(p, folder) for p in shown)}</div>"
                )
    return (
        "<p class='sub'>Rendered by Cycles with the measured material; environment images are the "
        f"only light.</p>{''.join(rows)}"
    )


def _figure(picture: Picture, folder: str) -> str:
    source = quote((Path(folder) / picture.file).as_posix())
    label = escape(picture.subject if picture.turn is None else f"{picture.subject}, turned")
    caption = f"<figcaption>{label}</figcaption>" if picture.turn is None else ""
    return f"<figure><img src='{source}' alt='{label}' loading='lazy'>{caption}</figure>"
