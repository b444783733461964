"""Parts that reports have in common: the page, a slider between two pictures, the summary."""

from __future__ import annotations

from collections.abc import Sequence
from html import escape
from pathlib import Path
from urllib.parse import quote

ASSETS = Path(__file__).parents[2] / "assets" / "report"
# of the same parts of both pages
ERROR_HEADING = "Median error of a pixel in a photo that was left out of the fit"
PHOTO_HEADING = "The most useful next photo"
STYLE, SCRIPT = ASSETS / "style.css", ASSETS / "script.js"


def page(heading: str, name: str, body: str, head: str = "", back: str = "") -> str:
    """A complete HTML page about a capture; name: of the capture; body: HTML; head: plain text
    below the heading; back: the page that this one is a part of, relative to it."""
    title = escape(f"{heading}: {name}")
    line = escape(name) if not head else f"{escape(name)} · {escape(head)}"
    up = f"<p><a href='{back}'>← Check of the capture</a></p>" if back else ""
    return (
        "<!doctype html><html lang='en'><meta charset='utf-8'><meta name='viewport' "
        f"content='width=device-width'><title>{title}</title>"
        f"<style>{STYLE.read_text('utf-8')}</style>{up}<h1>{escape(heading)}</h1>"
        f"<p class='sub'>{line}</p>{body}<script>{SCRIPT.read_text('utf-8')}</script></html>"
    )


def compared(first: str, second: str, labels: tuple[str, str]) -> str:
    """HTML: two pictures of one size (file names), with a slider between them. labels: plain
    text."""
    left, right = (escape(label) for label in labels)
    images = "".join(
        f"<img src='{escape(quote(file))}' alt='{label}'>"
        for file, label in ((first, left), (second, right))
    )
    return (
        f"<figure><div class='compare'>{images}<input type='range' min='0' max='100' value='50' "
        f"aria-label='{left} or {right}'></div><figcaption class='sides'><span>← {left}</span>"
        f"<span>{right} →</span></figcaption></figure>"
    )


def summary(pictures: Sequence[tuple[str, str]], parts: Sequence[tuple[str, str]]) -> str:
    """HTML: pictures of the materials (file, plain text), and headings, which may be empty, with
    HTML below them."""
    figures = "".join(
        f"<figure><img src='{escape(quote(file))}' alt='{escape(text)}'>"
        f"<figcaption>{escape(text)}</figcaption></figure>"
        for file, text in pictures
    )
    text = "".join(
        f"<b>{heading}</b>{content}" if heading else content for heading, content in parts
    )
    return f"<div class='summary'>{figures}<div>{text}</div></div>"
