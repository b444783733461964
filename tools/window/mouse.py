"""A real mouse in a real window: buttons are found by their text in a screenshot, moved to and
clicked with xdotool; clicks and typed keys are counted.

The text to find is drawn with Blender's own font, and searched for by normalised cross-correlation.
"""

from __future__ import annotations

import subprocess
import tempfile
import time
from collections.abc import Iterator
from pathlib import Path

import blf
import bpy
import gpu
import mathutils
import numpy as np
from numpy.typing import NDArray

Box = tuple[int, int, int, int]  # left, top, right, bottom, screen pixels

MIN_MATCH = 0.8  # correlation of a text with the screenshot: other texts stay below 0.7
FONT_POINTS = 11.0  # of Blender's labels, at a scale of 1
TEXT_HEIGHT, TEXT_BASE = 18, 5  # pixels of a template, and of its baseline from below
REST = 700, 500  # a place without buttons, pixels of the screen
MAX_LOST_CLICKS, CHECKS = 3, 5  # checks, two seconds apart, before a click counts as lost
SCALES = (1.0, 12 / 11)  # of the font: labels, and titles of panels


def screenshot() -> NDArray[np.float32]:
    """(h, w) grey values of the screen, from the top."""
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "screen.pgm"
        subprocess.run(["import", "-window", "root", "-depth", "8", str(path)], check=True)
        data = path.read_bytes()
    kind, size, _, pixels = data.split(b"\n", 3)
    assert kind == b"P5", kind
    width, height = map(int, size.split())
    return np.frombuffer(pixels, np.uint8).reshape(height, width).astype(np.float32)


def drawn(text: str, scale: float = 1.0) -> NDArray[np.float32]:
    """(h, w) coverage of a text in Blender's font, from the top."""
    points = FONT_POINTS * scale * bpy.context.preferences.system.ui_scale
    blf.size(0, points)
    width = int(blf.dimensions(0, text)[0]) + 2
    target = gpu.types.GPUOffScreen(width, TEXT_HEIGHT)
    with target.bind():
        frame = gpu.state.active_framebuffer_get()
        frame.clear(color=(0, 0, 0, 1))
        with gpu.matrix.push_pop(), gpu.matrix.push_pop_projection():
            scale = mathutils.Matrix.Diagonal((2 / width, 2 / TEXT_HEIGHT, 1, 1))
            gpu.matrix.load_matrix(mathutils.Matrix.Identity(4))
            gpu.matrix.load_projection_matrix(mathutils.Matrix.Translation((-1, -1, 0)) @ scale)
            blf.color(0, 1, 1, 1, 1)
            blf.position(0, 0, TEXT_BASE, 0)
            blf.draw(0, text)
        pixels = frame.read_color(0, 0, width, TEXT_HEIGHT, 4, 0, "FLOAT")
    pixels.dimensions = width * TEXT_HEIGHT * 4
    found = np.array(pixels, np.float32).reshape(TEXT_HEIGHT, width, 4)[::-1, :, 0]
    target.free()
    rows = np.flatnonzero(found.max(axis=1) > 0.05)
    return found[rows[0] : rows[-1] + 1]


def correlation(picture: NDArray[np.float32], text: NDArray[np.float32]) -> NDArray[np.float32]:
    """Normalised cross-correlation of a text with every place of a picture (its top left
    corner)."""
    height, width = text.shape
    pattern = text - text.mean()
    pattern /= np.linalg.norm(pattern)
    shape = picture.shape
    spectrum = np.fft.rfft2(picture)
    products = np.fft.irfft2(spectrum * np.conj(np.fft.rfft2(pattern, shape)), shape)
    sums = [np.pad(p.astype(np.float64).cumsum(0).cumsum(1), ((1, 0), (1, 0)))
            for p in (picture, picture**2)]  # fmt: skip
    rows, columns = shape[0] - height + 1, shape[1] - width + 1
    total, square = (
        s[height:, width:] - s[:-height, width:] - s[height:, :-width] + s[:-height, :-width]
        for s in sums
    )
    spread = np.sqrt(np.maximum(square - total**2 / text.size, 1.0))
    return (products[:rows, :columns] / spread).astype(np.float32)


def find(
    text: str, box: Box | None = None, turned: bool = False
) -> tuple[tuple[float, float], float]:
    """((x, y) of the middle of the best match, its correlation) in a box of the screen. turned: the
    text of a tab, which reads from top to bottom."""
    picture = screenshot()
    left, top, right, bottom = box or (0, 0, picture.shape[1], picture.shape[0])
    part = picture[top:bottom, left:right]
    best, place = -1.0, (0.0, 0.0)
    for scale in SCALES:
        pattern = np.rot90(drawn(text, scale), -1) if turned else drawn(text, scale)
        if pattern.shape[0] > part.shape[0] or pattern.shape[1] > part.shape[1]:
            continue
        values = np.abs(correlation(part, pattern))
        y, x = np.unravel_index(int(values.argmax()), values.shape)
        if values[y, x] > best:
            best = float(values[y, x])
            place = (left + x + pattern.shape[1] / 2, top + y + pattern.shape[0] / 2)
    return place, best


class Mouse:
    """Moves and clicks the mouse; clicks: how often; keys: how many keys were pressed."""

    def __init__(self) -> None:
        self.clicks = self.keys = 0
        self.log: list[str] = []

    def act(self, *words: object) -> None:
        """Run a mouse action in the background."""
        subprocess.Popen(
            ["xdotool", *map(str, words)], stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL
        )

    def press_key(self, key: str) -> float:
        """Press a key; returns the seconds to wait."""
        self.keys += 1
        self.log.append(f"key {key}")
        self.act("key", key)
        return 1.5

    def click_at(self, x: float, y: float, what: str, times: int = 1) -> float:
        """Click a place; returns the seconds to wait."""
        self.clicks += times
        self.log.append(f"{'click' if times == 1 else 'double click'} {what}")
        # a button under a resting pointer keeps the state that it had when it was entered
        words: list[object] = ["mousemove", *REST, "sleep", 0.3]
        words += ["mousemove", round(x) - 5, round(y), "sleep", 0.3]
        words += ["mousemove", round(x), round(y), "sleep", 0.4]
        words += ["click", "--repeat", times, "--delay", 80, 1]
        self.act(*words)
        return 2.5

    def click(
        self,
        text: str,
        box: Box | None = None,
        times: int = 1,
        timeout: float = 20.0,
        turned: bool = False,
        shift: int | None = None,
        vanishes: bool = False,
    ) -> Iterator[float]:
        """Click a text of the screen, waiting until it appears. box: where to look for it; turned:
        the text of a tab; shift: pixels to the right of its left end, to click what is beside it.
        vanishes: whether the text disappears then; a click that a busy window loses is repeated.
        Raises AssertionError after ``timeout`` seconds."""
        until = time.monotonic() + timeout
        while True:
            (x, y), match = find(text, box, turned)
            if match >= MIN_MATCH:
                break
            if time.monotonic() > until:
                raise AssertionError(
                    f"no text {text!r} on the screen: best correlation {match:.2f}"
                )
            yield 0.5
        if shift is not None:
            x += shift - drawn(text).shape[1] / 2
        yield self.click_at(x, y, text if shift is None else f"beside {text}", times)
        for _ in range(MAX_LOST_CLICKS if vanishes else 0):
            gone = False
            for _ in range(CHECKS):
                yield 2.0
                gone = find(text, box, turned)[1] < MIN_MATCH
                if gone:
                    break
            if gone:
                break
            self.log.append(f"lost click {text}")
            self.clicks -= 1
            yield self.click_at(x, y, text, times)
