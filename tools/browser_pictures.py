"""Pictures of the pages of a result in a browser, for docs/images:

    PATINA_CHROMIUM=.ci/chromium python -m tools.browser_pictures patina-demo

The report and the viewer of `run.py demo`. With a folder as second argument, they are photographed
there at the width of a phone, too, with a dark desktop.
"""

from __future__ import annotations

import os
import sys
from pathlib import Path

from playwright.sync_api import sync_playwright

from .browser_options import SOFTWARE_GL
from .common import ROOT

IMAGES = ROOT / "docs" / "images"
VIEWER, REPORT = "report/materials/viewer.html", "report/index.html"
PAGES = (  # (picture, page, width, height)
    ("viewer", VIEWER, 1400, 760),
    ("report", REPORT, 1400, 1000),
)
PHONE = (420, 900)  # pixels
QUALITY = 82  # of the JPEG files
PICTURES = 60  # that the viewer averages: software rendering is slow
MILLISECONDS = 600_000  # until a page must be ready


def main(result: Path, more: Path | None = None) -> int:
    """Photograph the pages into docs/images; with ``more`` all sizes into that folder."""
    shots = [(IMAGES if more is None else more, *page, False) for page in PAGES]
    if more is not None:
        shots += [(more, f"{name}_phone", file, *PHONE, True) for name, file, _, _ in PAGES]
    with sync_playwright() as playwright:
        browser = playwright.chromium.launch(
            executable_path=os.environ["PATINA_CHROMIUM"], args=list(SOFTWARE_GL)
        )
        for folder, name, page_file, width, height, dark in shots:
            page = browser.new_page(
                viewport={"width": width, "height": height},
                color_scheme="dark" if dark else "light",
            )
            page.set_default_timeout(MILLISECONDS)
            page.goto((result.resolve() / page_file).as_uri())
            if page_file == VIEWER:
                page.wait_for_function("window.patina !== undefined")
                page.evaluate(f"() => {{ window.patina.finish({PICTURES}); }}")
            target = folder / f"{name}.jpg"
            page.screenshot(path=str(target), type="jpeg", quality=QUALITY, timeout=MILLISECONDS)
            print(f"wrote {target}: {target.stat().st_size / 1000:.0f} kB")
            page.close()
        browser.close()
    return 0


if __name__ == "__main__":
    sys.exit(main(*map(Path, sys.argv[1:3])))
