"""JSON of a reconstruction tool, opened without believing it."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

from ...errors import InputError

LARGEST = 1 << 30  # bytes: Meshroom's .sfm with features' colours has some hundred MB


def read_json(path: Path) -> Any:
    """What the file says. Raises InputError naming file and line."""
    try:
        if path.stat().st_size > LARGEST:
            raise InputError("is too large for a file of cameras", file=path)
        text = path.read_text("utf-8-sig")
    except UnicodeDecodeError as error:
        raise InputError("is not a text in UTF-8", file=path) from error
    except OSError as error:
        raise InputError(f"cannot be read ({error.strerror})", file=path) from error
    try:
        return json.loads(text)
    except json.JSONDecodeError as error:
        raise InputError(
            f"is not valid JSON ({error.msg})", file=path, line=error.lineno
        ) from error
    except (RecursionError, ValueError) as error:  # nested, or a number, beyond all bounds
        raise InputError(
            "is not a JSON that any tool writes (nested too deep)", file=path
        ) from error
