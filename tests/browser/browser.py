"""A browser for tests: the program named in PATINA_CHROMIUM, driven by Playwright."""

from __future__ import annotations

import os
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import pytest

from tools.browser_options import SOFTWARE_GL

FOLDER = Path(__file__).parent
START_MS, ACTION_MS = 120_000, 300_000


def program() -> str:
    """The browser; skips the test where there is none."""
    found = os.environ.get("PATINA_CHROMIUM")
    if not found:
        pytest.skip("PATINA_CHROMIUM names no browser")
    return found  # a missing Playwright is an error then


@contextmanager
def opened(
    file: Path, size: tuple[int, int], dark: bool = False
) -> Iterator[tuple[Any, list[str]]]:
    """(the open page, the errors it has reported so far). size: of the window, pixels."""
    from playwright.sync_api import sync_playwright

    errors: list[str] = []
    with sync_playwright() as playwright:
        browser = playwright.chromium.launch(
            executable_path=program(), args=list(SOFTWARE_GL), timeout=START_MS
        )
        page = browser.new_page(
            viewport={"width": size[0], "height": size[1]},
            color_scheme="dark" if dark else "light",
        )
        page.set_default_timeout(ACTION_MS)
        page.on("console", lambda m: errors.append(m.text) if m.type == "error" else None)
        page.on("pageerror", lambda error: errors.append(str(error)))
        page.on("requestfailed", lambda request: errors.append(f"failed: {request.url}"))
        page.goto(file.as_uri())
        yield page, errors
        browser.close()
