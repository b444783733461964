"""The interface in other languages."""

from __future__ import annotations

import bpy
from support import extension

MESSAGES = ("Import Demo Capture", "Look Through Photo", "Number of the photo in the list")


def test_labels_and_tooltips_are_translated():
    tables = extension("panels.translations").tables()
    view = bpy.context.preferences.view
    before = view.language, view.use_translate_interface, view.use_translate_tooltips
    tested = 0
    try:
        for locale, texts in tables.items():
            try:
                view.language = locale
            except TypeError:  # a build without this language
                continue
            view.use_translate_interface = view.use_translate_tooltips = True
            for message in MESSAGES:
                expected = texts["*", message]
                assert bpy.app.translations.pgettext_iface(message) == expected
                assert bpy.app.translations.pgettext_iface(message, "Operator") == expected
                assert bpy.app.translations.pgettext_tip(message) == expected
            tested += 1
    finally:
        view.language, view.use_translate_interface, view.use_translate_tooltips = before
    print(f"{tested} of {len(tables)} languages tested")
