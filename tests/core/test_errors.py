"""Messages stay one line that can be read, whatever a damaged file holds."""

from __future__ import annotations

from patina.core.errors import MAX_WORD, InputError


def test_long_names_are_shortened_in_the_middle():
    name = "begin" + 400 * "9" + "end"
    text = str(InputError(f"found {name!r}", file="cameras.csv", line=3))
    assert text.startswith("cameras.csv:3: found 'begin99") and text.endswith("99end'")
    assert len(text) < MAX_WORD + 50


def test_a_message_is_one_line():
    error = InputError("found this;\n  expected that", key="scan.mesh")
    assert error.detail == "found this; expected that"
    assert str(error) == "[scan.mesh]: found this; expected that"
    assert str(InputError("two\nlines")) == "two lines"
