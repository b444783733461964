"""JSON of a reconstruction tool, opened without believing it."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

from ...errors import InputError

LARGEST = 1 << 30  # bytes: Meshroom's .sfm with features' colours has some hundred MB


def read_json(path: Path, largest: int = LARGEST, what: str = "a file of cameras") -> Any:
    """What the file says; largest: bytes. Raises InputError naming file and line."""
    try:
        if path.stat().st_size > largest:
            raise InputError(f"is too large for {what}", file=path)
        with open(path, "rb") as opened:
            text = opened.read(largest + 1).decode("utf-8-sig")
    except UnicodeDecodeError as error:
        raise InputError("is not a text in UTF-8", file=path) from error
    except (OSError, ValueError) as error:  # ValueError: a path with a zero byte
        reason = getattr(error, "strerror", None) or error
        raise InputError(f"cannot be read ({reason})", file=path) from error
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
