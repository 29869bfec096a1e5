"""Tests of invalid TOML files: each error is a short sentence that names the file."""

import pytest

from pneuforce.errors import ConfigurationError
from pneuforce.instrument.config import load

DIGITS = "9" * 5000


@pytest.mark.parametrize(
    ("content", "reason"),
    [
        (f"a = {DIGITS}", "not TOML: a number with thousands of digits"),
        (f"[balloon]\nid = 0x{'f' * 20_000}", "a number with thousands of digits"),
        (f"[balloon]\nyoung_kpa = 0x{'f' * 20_000}", "a number with thousands of digits"),
        (f"[balloon]\nid = {'9' * 4000}", "balloon.id = 99999"),
        ("a = " + "[" * 100_000, "not TOML: brackets are nested too deeply"),
        ("a = " + "{a = " * 100_000, "not TOML: brackets are nested too deeply"),
        (f"[rig]\nport = {[1] * 5000}", "rig.port = [1, 1,"),
        ("balloon = 1", "balloon = 1: must be a table"),
    ],
)
def test_an_invalid_file_is_reported_in_a_short_sentence(tmp_path, content, reason):
    path = tmp_path / "instrument.toml"
    path.write_text(content)
    with pytest.raises(ConfigurationError) as error:
        load(path)
    assert str(error.value).startswith(f"{path}: ")
    assert reason in str(error.value)
    assert len(str(error.value)) < len(str(path)) + 300
