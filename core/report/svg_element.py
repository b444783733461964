"""A drawing of a report, as SVG element."""

from __future__ import annotations


def svg_element(width: int, height: int, label: str, content: str) -> str:
    """width, height: in pixels. label: read aloud by screen readers, as HTML. content: the shapes,
    as SVG."""
    return (
        f"<svg viewBox='0 0 {width} {height}' width='{width}' height='{height}' role='img' "
        f"aria-label='{label}' font-size='10' font-family='sans-serif' fill='currentColor'>"
        f"{content}</svg>"
    )
