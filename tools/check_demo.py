"""Check what `run.py demo` found: `python -m tools.check_demo FOLDER`.

The demo capture has a near lamp and one photo with another exposure (assets/demo/README.md). Both
must be named, nothing else, and held-out photos must be predicted better with them.
"""

from __future__ import annotations

import json
import math
import sys
from pathlib import Path

from .common import ROOT, say

EXPECTED = {"near_light", "light_intensity"}
MAX_DRIFT_ERROR = 0.03  # of the ratio of both exposures
MAX_RATIO = 0.85  # of the typical error of held-out photos, with the causes ÷ without


def main(folder: Path) -> int:
    """Print every difference; return 1 if there is one."""
    found = json.loads((folder / "diagnosis.json").read_text("utf-8"))
    truth = json.loads((ROOT / "assets" / "demo" / "truth.json").read_text("utf-8"))
    wrong = []
    named = set(found["named"])
    if named != EXPECTED or set(found["applied"]) != EXPECTED:
        wrong.append(f"named {sorted(named)}, included {sorted(found['applied'])}")
    causes = {cause["cause"]: cause for cause in found["causes"]}
    if causes.keys() >= EXPECTED:
        wrong += _wrong_drift(causes["light_intensity"], truth)
    for material in found["materials"]:
        before, after = material["typical_before"], material["typical_after"]
        say(f"{material['name']}: held-out photos {100 * before:.1f} → {100 * after:.1f} %")
        if after > MAX_RATIO * before:
            wrong.append(f"{material['name']}: held-out photos are not predicted better")
    for line in wrong:
        say(f"demo: {line}")
    return 1 if wrong else 0


def _wrong_drift(cause: dict, truth: dict) -> list[str]:
    """What is wrong about the ratio of the exposures of both photos of the lamp that drifted."""
    exposures = [photo["exposure"] for photo in truth["photos"]]
    drifted = max(range(len(exposures)), key=exposures.__getitem__)
    lamp = truth["photos"][drifted]["light"]
    (other,) = (
        i for i, photo in enumerate(truth["photos"]) if photo["light"] == lamp and i != drifted
    )
    gain = {name: p["value"] for name, p in cause["parameters"].items()}
    ratio = math.exp(gain[f"photo {drifted + 1}"] - gain[f"photo {other + 1}"])
    true = exposures[drifted] / exposures[other]
    say(f"photo {drifted + 1}: {ratio:.3f} times photo {other + 1}, in truth {true:.3f}")
    return [] if abs(ratio - true) < MAX_DRIFT_ERROR else [f"the drift is {ratio:.3f}"]


if __name__ == "__main__":
    sys.exit(main(Path(sys.argv[1])))
