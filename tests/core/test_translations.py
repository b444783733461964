"""Every label and tooltip has a translation in every language that is shipped."""

from __future__ import annotations

import re

import pytest

from tools.translation_messages import messages, translations

LOCALES = ("de_DE", "ja_JP")
UNCHANGED = re.compile(
    r"Patina|MERL|glTF|USD|OSL|OpenPBR|\.binary|\.capture\.toml|result\.json|PNG"
)


def test_the_languages_are_shipped() -> None:
    assert set(LOCALES) <= translations().keys()


@pytest.mark.parametrize("locale", LOCALES)
def test_a_language_has_exactly_the_messages_of_the_interface(locale: str) -> None:
    texts = translations()[locale]
    assert not messages().keys() - texts.keys()
    assert not texts.keys() - messages().keys()


@pytest.mark.parametrize("locale", LOCALES)
def test_translations_keep_names_and_punctuation(locale: str) -> None:
    for message, text in translations()[locale].items():
        assert text.strip() == text != "", message
        assert set(UNCHANGED.findall(message)) <= set(UNCHANGED.findall(text)), message
        assert message.endswith(".") or not text.endswith((".", "。")), message
        assert message.endswith(("…", ":")) == text.endswith(("…", ":", "：")), message
