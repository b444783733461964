"""MkDocs hook: publish the JSON Schemas of assets/schemas as reference/schemas/NAME."""

from __future__ import annotations

from pathlib import Path
from typing import Any

from mkdocs.structure.files import File

SCHEMAS = Path(__file__).parents[1] / "assets" / "schemas"


def on_files(files: Any, config: Any) -> Any:
    """Add all schemas to the files of the site; pages link to schemas/NAME.schema.json."""
    for schema in sorted(SCHEMAS.glob("*.schema.json")):
        name = f"reference/schemas/{schema.name}"
        files.append(File.generated(config, name, abs_src_path=str(schema)))
    return files
