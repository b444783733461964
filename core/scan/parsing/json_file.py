"""Open a reconstruction tool's JSON, within limits on its size."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

from ...errors import InputError
from ...files import regular_size

MAX_FILE_BYTES = 1 << 30  # Meshroom's .sfm with feature colours has some hundred MB


def read_json(path: Path, max_bytes: int = MAX_FILE_BYTES, what: str = "a file of cameras") -> Any:
    """The parsed content of a file of at most ``max_bytes``. Raises InputError with file and
    line."""
    try:
        if regular_size(path) > max_bytes:
            raise InputError(f"is too large for {what}", file=path)
        with open(path, "rb") as opened:
            text = opened.read(max_bytes + 1).decode("utf-8-sig")
    except UnicodeDecodeError as error:
        raise InputError("is not UTF-8 text", file=path) from error
    except (OSError, ValueError) as error:  # ValueError: the path contains a zero byte
        reason = getattr(error, "strerror", None) or error
        raise InputError(f"cannot be read ({reason})", file=path) from error
    try:
        return json.loads(text)
    except json.JSONDecodeError as error:
        raise InputError(
            f"is not valid JSON ({error.msg})", file=path, line=error.lineno
        ) from error
    except (
        RecursionError,
        ValueError,
    ) as error:  # nested too deep, or an integer with too many digits
        raise InputError(
            "is nested too deep; expected the JSON of a reconstruction tool", file=path
        ) from error
