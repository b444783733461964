"""The camera of the viewer, and its pictures as numbers."""

from __future__ import annotations

import base64
import math
from typing import Any

import numpy as np

SIDE = 160  # pixels
EYE = np.array([0.0, -5.2, 0.9])  # as in web/src/main.js
FIELD = 26.0  # degrees, as in web/src/renderer.js
LAMP = np.array([0.5, -0.6, 0.62]) / np.linalg.norm([0.5, -0.6, 0.62])  # as in web/src/main.js


def rays() -> np.ndarray:
    """(SIDE, SIDE, 3) unit directions of the pixels' centres."""
    forward = -EYE / np.linalg.norm(EYE)
    right = np.cross(forward, [0.0, 0.0, 1.0])
    right /= np.linalg.norm(right)
    up = np.cross(right, forward)
    u = ((np.arange(SIDE) + 0.5) / SIDE * 2 - 1) * math.tan(math.radians(FIELD / 2))
    x, y = np.meshgrid(u, -u)
    ray = forward + x[..., None] * right + y[..., None] * up
    return np.asarray(ray / np.linalg.norm(ray, axis=-1, keepdims=True))


def averaged(page: Any, pictures: int, state: str = "{}") -> np.ndarray:
    """(SIDE, SIDE, 4) the mean of the viewer's pictures, row 0 on top. state: changes of the state,
    a JavaScript object."""
    page.wait_for_function("window.patina !== undefined")
    text = page.evaluate(
        f"""() => {{
          const {{ state, renderer }} = window.patina;
          Object.assign(state, {state});
          renderer.resize({SIDE}, {SIDE});
          const raw = new Uint8Array(window.patina.finish({pictures}).buffer);
          let text = "";
          for (const each of raw) text += String.fromCharCode(each);
          return btoa(text);
        }}"""
    )
    return np.frombuffer(base64.b64decode(text), "<f4").reshape(SIDE, SIDE, 4)[::-1]
