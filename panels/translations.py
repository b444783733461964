"""Translations of labels and tooltips (assets/translations): one JSON file for each language, with
the English message as key."""

from __future__ import annotations

import json
from pathlib import Path

import bpy

FOLDER = Path(__file__).parents[1] / "assets" / "translations"
# of messages; "Operator": names of operators; "Patina": the panels (stage.py)
CONTEXTS = ("*", "Operator", "Patina")


def tables() -> dict[str, dict[tuple[str, str], str]]:
    """Locale → (context, message) → translation, as Blender takes it."""
    return {
        file.stem: {
            (context, message): translation
            for message, translation in json.loads(file.read_text("utf-8")).items()
            for context in CONTEXTS
        }
        for file in sorted(FOLDER.glob("*.json"))
    }


def _name() -> str:
    """Name of the extension, under which Blender keeps the translations."""
    return (__package__ or "").rpartition(".")[0]


def register() -> None:
    bpy.app.translations.register(_name(), tables())


def unregister() -> None:
    bpy.app.translations.unregister(_name())
