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


@pytest.mark.parametrize(
    ("content", "reason"),
    [
        (b"\xef\xbb\xbf[rig]\n", "line 1 begins with a byte order mark (BOM): save the file as UTF-8"),
        (
            "[rig]\n# Prüfstand\n".encode("latin-1"),
            "line 2 is not UTF-8: save the file as UTF-8 (without BOM)",
        ),
        ("[rig]\n".encode("utf-16"), "line 1 is not UTF-8: save the file as UTF-8 (without BOM)"),
        (b"[modbus]\nport = 1\n\nport = 2\nunit = 1\n", "line 4: the key port has a value already"),
        (b"[modbus]\nport = 1\nport = 2", "line 3: the key port has a value already"),
        (b"[web]\nallow = []\nallow = [\n  '::1'\n]\nport = 1\n", "the key allow has a value already"),
        (b"[web]\nport = 1\n[web]\n", "line 3: the table [web] is there already"),
        (b"[web]\n= 1\n", "not TOML: Invalid"),
    ],
)
def test_an_encoding_or_a_duplicate_is_reported_with_its_line(tmp_path, content, reason):
    path = tmp_path / "instrument.toml"
    path.write_bytes(content)
    with pytest.raises(ConfigurationError) as error:
        load(path)
    assert reason in str(error.value)
