"""Names in captures cannot control the terminal."""

from __future__ import annotations

import sys
import unicodedata

import pytest
from hypothesis import given
from hypothesis import strategies as st

from patina.commands import command_line
from patina.commands.plain_output import plain_output, visible
from tests import make_capture as made


@given(st.text())
def test_text_without_control_characters_is_unchanged(text):
    found = visible(text)
    assert all(c in "\t\n" or unicodedata.category(c) not in ("Cc", "Cs") for c in found)
    if text.isprintable():
        assert found == text


def test_escape_codes_are_shown(capsys):
    with plain_output():
        print("a\x1b[2Jb\u202ec\x9b1md\tend")
        print("oh\x07", file=sys.stderr)
    out, err = capsys.readouterr()
    assert out == "a\\x1b[2Jb\\u202ec\\x9b1md\tend\n" and err == "oh\\x07\n"


def test_camera_label_of_a_stranger_does_not_reach_the_terminal(tmp_path, capsys):
    file = made.make_capture(tmp_path, photos=1)
    text = file.read_text("utf-8").replace('"view_01.jpg"', '"\\u001b]0;owned\\u0007"')
    file.write_text(text, "utf-8")
    assert command_line.main(["fit", str(file), "--out", str(tmp_path / "out")]) == 2
    out, err = capsys.readouterr()
    assert "\x1b" not in out + err and "\x07" not in out + err
    assert "\\x1b]0;owned" in err


@pytest.mark.parametrize(("error", "said"), [
    (OSError(28, "No space left on device", "/x/y"), "patina: /x/y: No space left on device"),
    (OSError("no network"), "patina: no network"),
    (MemoryError(), "patina: the memory was not sufficient"),
])  # fmt: skip
def test_faults_of_the_machine_are_one_line(monkeypatch, capsys, error, said):
    def fail(_):
        raise error

    monkeypatch.setattr("patina.commands.compare.run", fail)
    assert command_line.main(["compare", "a", "b"]) == 2
    found = capsys.readouterr().err
    assert found.startswith(said) and found.count("\n") == 1
